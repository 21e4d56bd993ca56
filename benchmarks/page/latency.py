"""Time from the movement of a slider to the picture in a browser, with five figures and three laws.

``python -m benchmarks.page.latency`` opens Explore with the air layer, so that it has all five
figures, and moves the slider of the amplitude by keyboard. The page measures the times, from the
event of the slider to the frame after the figures were written (`performance.measure`). The first
movements are left out; a movement whose request was replaced by a newer one has no time.
"""

from __future__ import annotations

import argparse
import statistics
from typing import Any

from benchmarks.page.serving import chromium, load, quantile, serving

VIEW = "#explore?law=elasto-plastic&laws=rice-ruina,linker-dieterich&epsilon=0.1&air=1"
_TIMES = "performance.getEntriesByName('slider to picture').map((e) => e.duration)"
_WARM = 10


def times(page: Any) -> list[float]:
    """Times (ms) that the page has measured."""
    milliseconds: list[float] = page.evaluate(_TIMES)
    return milliseconds


def opened(browser: Any, port: int, view: str = VIEW) -> Any:
    """The page with all laws compiled."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(300_000)
    page.goto(f"http://127.0.0.1:{port}/{view}")
    page.locator(".sentence", has_text="able:").wait_for()
    while "Preparing" in page.locator("#state").inner_text():
        page.wait_for_timeout(200)
    return page


def slider(page: Any, meaning: str) -> Any:
    """A slider by the meaning of its number."""
    return page.locator(".quantity", has_text=meaning).locator("input[type=range]")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--movements", type=int, default=200)
    options = parser.parse_args()
    with serving() as server, chromium() as browser:
        page = opened(browser, server.port)
        shown = page.locator("figure:visible").count()
        handle = slider(page, "relative amplitude")
        handle.focus()
        for number in range(options.movements + _WARM):
            before = len(times(page))
            handle.press("ArrowRight" if number % 100 < 50 else "ArrowLeft")
            while len(times(page)) == before:
                page.wait_for_timeout(5)
        last = times(page)[-options.movements :]
        print(
            f"{len(last)} movements, {shown} figures, 3 laws: median "
            f"{statistics.median(last):.0f} ms, p95 {quantile(last, 0.95):.0f} ms, longest "
            f"{max(last):.0f} ms; {load()}"
        )


if __name__ == "__main__":
    main()
