"""Tables 1 to 6 of the extended Audio2Gestures paper, on corpora of our own, with the paper's figures."""
