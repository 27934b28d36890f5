"""Property tests here have no time limit for one example: the machine may be busy with others."""

from hypothesis import settings

settings.register_profile("rig", deadline=None, derandomize=True)
settings.load_profile("rig")
