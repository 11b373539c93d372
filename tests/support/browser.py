"""A page as a real browser lays it out; tests that need one skip where none is installed."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "google-chrome", "chromium-browser"))), ""
)
_WAIT = 4000
"""Time of the page, which passes faster than ours, after which it is read [ms]."""
_MEASURE = """<!doctype html><body style="margin:0">
<iframe style="width:{width}px;height:2000px;border:0" srcdoc="{page}"></iframe><script>
addEventListener("load",()=>{{const d=document.querySelector("iframe").contentDocument,
 seen=[...d.querySelectorAll("main *")].filter(e=>e.textContent.trim()&&!e.children.length),
 sizes=seen.map(e=>parseFloat(d.defaultView.getComputedStyle(e).fontSize)),
 wide=[...d.querySelectorAll("h1,h2,p,dt,dd,figcaption")].map(e=>e.getBoundingClientRect().right);
 document.body.innerHTML="<pre>"+JSON.stringify({{page:d.documentElement.scrollWidth,
 text:Math.max(...wide),font:Math.min(...sizes)}})+"</pre>"}})
</script>"""


def dom_of(address: str, folder: Path) -> str:
    """Return the document at an address after its scripts have run.

    Args:
        address: of the page.
        folder: for the browser's own files.
    """
    if not CHROMIUM:
        pytest.skip("no browser is installed")
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        f"--user-data-dir={folder / 'browser'}", f"--virtual-time-budget={_WAIT}", "--dump-dom",
    ]  # fmt: skip
    done = subprocess.run(
        [*command, address], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout


def measured(page: str, width: int, folder: Path) -> dict[str, Any]:
    """Return how a page stands in a window of some width.

    Args:
        page: its HTML.
        width: of the window [px].
        folder: empty.

    Returns:
        `page`: width of the document; `text`: right edge of headings and paragraphs; `font`: the
        smallest letters [px].
    """
    file = folder / "measure.html"
    file.write_text(_MEASURE.format(width=width, page=html.escape(page)), encoding="utf-8")
    found = re.search(r"<pre>(.*?)</pre>", dom_of(file.as_uri(), folder), re.DOTALL)
    assert found is not None
    told: dict[str, Any] = json.loads(html.unescape(found[1]))
    return told
