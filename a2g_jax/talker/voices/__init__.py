"""Speech in real languages: our sentences, spoken by eSpeak NG, with the talker's speakers, emotions and accents.

The library is optional (the extra ``voices``) and loaded at run time; nothing of it is part of this package.
"""
