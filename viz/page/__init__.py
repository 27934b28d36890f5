"""One page that computes: a scan or a fit in a file that any browser opens, without server or network.

The page's own sources stand beside this: page.html, page.css and the .js files, read in the order of
`join.SCRIPTS`. The model's functions are printed from its formula (`clbrdf.models.javascript`).
"""

from clbrdf.viz.page.join import page_text, save_page
from clbrdf.viz.page.record import PageSubject, open_for_page

__all__ = ["PageSubject", "open_for_page", "page_text", "save_page"]
