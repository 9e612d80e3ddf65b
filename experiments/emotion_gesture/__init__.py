"""EmotionGesture's Tables I to IV, and claims about the method, on the generated corpus."""
