"""Motion while speech arrives: a few frames at a time, in bounded memory."""
