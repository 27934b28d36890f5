"""OpenCL sources: lib/ for arithmetic, models/ with one file per model, and one file per job."""
