"""What single models do better than what follows from their pages: one file a model, all of it optional.

A file holds `TUNED`, fields of `Model` by name that replace the derived ones; its kernel stands in
kernels/models/<name>.cl and is written by hand.
"""

NAMES = ("wang2013",)
"""Of the models that have such a file."""
