"""Tables 1 to 6 of the extended Audio2Gestures paper, on corpora of our own, beside the paper's figures."""
