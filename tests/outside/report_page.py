"""Opens the page of a stress study in headless Chromium, as a phone and a desk show it, for tests/sweep.rs.

usage: report_page.py index.html [FOLDER FOR SCREENSHOTS]

Prints, as JSON, for each width how many figures and pictures there are, and what is wrong: errors that were logged, requests to
anything but the file, figures that take no room, texts of figures that are cut off or that lie on one another, pictures that did
not load, a page that is wider than the screen. Chromium is the system's; exits with 77 where there is none.
"""

import json
import pathlib
import shutil
import sys

from playwright.sync_api import sync_playwright

WIDTHS_PX = (390, 1280)
NO_BROWSER = 77
LOOK = """() => {
  const faults = [], page = document.documentElement.clientWidth;
  const figures = [...document.querySelectorAll('figure > svg')], pictures = [...document.images];
  if (document.documentElement.scrollWidth > page) faults.push(`the page is ${document.documentElement.scrollWidth} px wide`);
  for (const svg of figures) {
    const name = svg.parentElement.dataset.name, box = svg.getBoundingClientRect();
    if (box.width < 200 || box.height < 60) faults.push(`${name} is ${box.width} x ${box.height} px`);
    if (box.left < 0 || box.right > page) faults.push(`${name} reaches from ${box.left} to ${box.right} px`);
    const marks = svg.querySelectorAll('rect, circle, polyline, line').length;
    if (marks < 5) faults.push(`${name} has ${marks} marks`);
    const level = [];
    for (const text of svg.querySelectorAll('text')) {
      const at = text.getBoundingClientRect();
      if (at.left < box.left - 1 || at.right > box.right + 1 || at.top < box.top - 1 || at.bottom > box.bottom + 1)
        faults.push(`${name} cuts off "${text.textContent}"`);
      if (!text.hasAttribute('transform')) level.push([text.textContent, at]);
    }
    level.forEach(([one, a], k) => level.slice(k + 1).forEach(([other, b]) => {
      // A line of text has some room above and below its letters, which may be shared.
      const [wide, high] = [Math.min(a.right, b.right) - Math.max(a.left, b.left), Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top)];
      if (wide > 1 && high > 0.4 * Math.min(a.height, b.height)) faults.push(`${name}: "${one}" lies on "${other}"`);
    }));
  }
  for (const picture of pictures)
    if (!picture.complete || picture.naturalWidth === 0 || picture.getBoundingClientRect().height < 10)
      faults.push(`picture "${picture.alt}" is not drawn`);
  return { figures: figures.map(svg => svg.parentElement.dataset.name), pictures: pictures.length, faults };
}"""


def look(browser, page_file, width, screenshots):
    page = browser.new_page(viewport={"width": width, "height": 844}, is_mobile=width < 500)
    faults = []
    page.on("console", lambda message: message.type in ("error", "warning") and faults.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))
    page.on("request", lambda request: request.url.startswith(("file:", "data:")) or faults.append(f"asks for {request.url}"))
    page.on("requestfailed", lambda request: faults.append(f"does not get {request.url[:80]}"))
    page.goto(page_file.as_uri(), wait_until="load")
    told = page.evaluate(LOOK)
    told["faults"] = faults + told["faults"]
    if screenshots:
        page.screenshot(path=screenshots / f"page-{width}.png", full_page=True)
    page.close()
    return told


def main(page_file, screenshots=None):
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next(filter(None, map(shutil.which, names)), None)
    if program is None:
        print(f"none of {', '.join(names)} is installed", file=sys.stderr)
        raise SystemExit(NO_BROWSER)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program)
        screenshots = screenshots and pathlib.Path(screenshots)
        told = {str(width): look(browser, pathlib.Path(page_file).resolve(), width, screenshots) for width in WIDTHS_PX}
        browser.close()
    print(json.dumps(told))


if __name__ == "__main__":
    main(*sys.argv[1:])
