"""The models: one page a model, nothing else in this folder."""
