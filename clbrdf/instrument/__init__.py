"""The instrument as the light sees it: which directions and wavelengths stand behind one measured value.

Shared by scenes, which put these effects into a scan, and by fits, which take them out again. Each effect
stands in its own file: what it does, its formula and source, its settings.
"""
