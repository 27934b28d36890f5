"""Emulated instruments: the same bytes as the real ones, over pseudo-terminals, with physics behind them.

Users without hardware, the demo and the tests measure with them; every fault of a laboratory can be
injected by name, at a chosen exchange or at random from a seed.
"""
