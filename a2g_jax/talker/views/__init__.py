"""Views of generated recordings: the formats of the field's data sets."""
