"""Names of the rows of a report that are no runs."""

#: Motions of baselines, in the order of the table.
MOTIONS = (
    "truth",
    "another right motion",
    "truth, 1 degree of noise",
    "truth, 5 degrees of noise",
    "nearest neighbour in audio",
    "another clip's motion",
    "first pose held",
    "mean pose",
)
#: The floor of FGD: two random halves of the truth's vectors.
HALVES = "one half of the truth against the other"
BASELINES = (*MOTIONS, HALVES)
