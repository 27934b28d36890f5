"""The rig: drivers, kinematics, plans, acquisition that loses nothing, calibration, error budget.

A measurement is a plan (where to look) run on a rig (what to look with). Rows stream into segment files
while it runs; when it is whole, the segments are joined, calibrated by equation (2) and saved as a Scan
that carries its raw counts along.
"""
