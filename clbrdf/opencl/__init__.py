"""OpenCL: the device, its lanes, how a program is put together, precisions and values (`values.py`)."""
