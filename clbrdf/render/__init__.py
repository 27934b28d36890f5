"""Materials as other programs take them, and pictures of them by Mitsuba.

`sources` makes an exportable material of a fit or a scan, `stage` is the scene,
`picture` renders it. Mitsuba is loaded only to render.
"""
