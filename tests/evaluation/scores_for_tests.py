"""Cells of a table of scores."""


def score(result, row, metric):
    """Mean of a cell."""
    (found,) = [each for each in result["rows"] if each["name"] == row]
    return found["scores"][metric]["mean"]
