"""Whether a broken body leaves the package: checks of many generations, of true and of real motion."""
