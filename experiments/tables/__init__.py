"""Tables of the papers: variants trained with several seeds, records kept, claims judged, Markdown rendered."""
