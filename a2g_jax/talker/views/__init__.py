"""The talker as the field's data sets show their speakers."""
