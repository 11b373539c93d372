"""The HTML page of the report: one file, no network, images inside."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import cv2

from intent_imitation.demo.report_text import Figure, Rows
from intent_perception.geometry.coded_images import read_picture

_STYLE = """
:root{--ink:#1f2933;--soft:#5c6873;--line:#e1e6eb;--card:#fff;--back:#f5f7f9;--accent:#0b7a57}
*{box-sizing:border-box}
body{margin:0;background:var(--back);color:var(--ink);line-height:1.55;
font-family:system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:1180px;margin:0 auto;padding:2.2rem 1.2rem 4rem}
header p{font-size:1.22rem;max-width:52rem;margin:.4rem 0 1.4rem}
h1{font-size:1.9rem;line-height:1.2;margin:0}
h2{font-size:1.35rem;margin:0 0 .2rem}
h3{font-size:1rem;margin:1.2rem 0 .4rem}
.kicker{color:var(--accent);font-weight:600;letter-spacing:.04em;margin:0 0 .3rem;font-size:.95rem}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:.8rem;
margin:0 0 1.4rem;padding:0}
.figures div{background:var(--card);border:1px solid var(--line);border-radius:10px;
padding:.75rem .95rem}
.figures dd{margin:0;font-size:1.3rem;font-weight:650;line-height:1.25}
.figures dt{color:var(--soft);font-size:.86rem}
.figures div{display:flex;flex-direction:column-reverse;justify-content:flex-end}
section{background:var(--card);border:1px solid var(--line);border-radius:12px;
padding:1.3rem 1.4rem 1.5rem;margin:0 0 1.4rem}
section>p{color:var(--soft);max-width:52rem;margin:.2rem 0 1rem}
figure{margin:0 0 1.2rem}
figure img{display:block;width:100%;height:auto;border-radius:8px}
figure.narrow img{max-width:760px}
figure div{overflow-x:auto}
@media (max-width:640px){
main{padding:1.2rem .7rem 2rem}
section{padding:.9rem .8rem 1rem}
h1{font-size:1.5rem}
figure:not(.narrow) img{width:820px;max-width:none}
figure:not(.narrow) figcaption::before{content:"Swipe sideways. "}
}
figcaption{color:var(--soft);font-size:.92rem;margin-top:.45rem}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.9rem;width:100%;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:.38rem .8rem .38rem 0;border-bottom:1px solid var(--line);
white-space:nowrap}
th{color:var(--soft);font-weight:600}
footer{color:var(--soft);font-size:.9rem}
"""


@dataclass(frozen=True)
class PagePicture:
    """An image file with the words that stand for it."""

    path: Path
    text: str
    narrow: bool = False


@dataclass(frozen=True)
class Chapter:
    """One section of the page."""

    title: str
    lead: str
    pictures: Sequence[PagePicture]
    missing: str
    """What is said where there is no picture."""
    tables: Sequence[Rows | None] = ()


def page(
    origin: str,
    summary: str,
    figures: Sequence[Figure],
    flow: PagePicture,
    chapters: Sequence[Chapter],
    footer: str,
) -> str:
    """Return the page as HTML text.

    Args:
        origin: one line on the recording and the run.
        summary: what happened, in sentences.
        figures: the numbers that a reader wants first.
        flow: the whole process as one picture.
        chapters: the sections below.
        footer: where all this comes from.
    """
    numbers = "".join(
        f"<div><dt>{escape(f.caption)}</dt><dd>{escape(f.value)}</dd></div>" for f in figures
    )
    body = "".join(_chapter(chapter) for chapter in chapters)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Goal-directed grasp imitation</title><style>{_STYLE}</style></head><body><main>"
        f'<header><p class="kicker">{escape(origin)}</p>'
        f"<h1>From a demonstration to the robot's grasp</h1><p>{escape(summary)}</p></header>"
        f'<dl class="figures">{numbers}</dl>'
        f"<section><h2>At a glance</h2>{_picture(flow)}</section>{body}"
        f"<footer>{escape(footer)}</footer></main></body></html>\n"
    )


def _chapter(chapter: Chapter) -> str:
    inside = "".join(_picture(picture) for picture in chapter.pictures)
    if not inside:
        inside = f"<p><strong>{escape(chapter.missing)}</strong></p>"
    inside += "".join(_table(rows) for rows in chapter.tables if rows is not None)
    return (
        f"<section><h2>{escape(chapter.title)}</h2><p>{escape(chapter.lead)}</p>{inside}</section>"
    )


def _picture(picture: PagePicture) -> str:
    kind = ' class="narrow"' if picture.narrow else ""
    return (
        f'<figure{kind}><div><img src="{_embedded(picture.path)}" alt="{escape(picture.text)}">'
        "</div>"
        f"<figcaption>{escape(picture.text)}</figcaption></figure>"
    )


def _embedded(path: Path) -> str:
    """Return the image as a data URI: JPEG, a fifth of the PNG's size."""
    image = read_picture(path, cv2.IMREAD_COLOR)
    _, coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 88])
    return "data:image/jpeg;base64," + base64.b64encode(coded.tobytes()).decode("ascii")


def _table(rows: Rows) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in rows.head)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows.rows
    )
    return (
        f'<h3>{escape(rows.title)}</h3><div class="scroll"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )
