"""The features of a trained EmotionGesture."""
