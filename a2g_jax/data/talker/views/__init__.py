"""The generated talker as the public data sets would have recorded it: BEAT, Speech2Gesture, TED; and capture noise."""
