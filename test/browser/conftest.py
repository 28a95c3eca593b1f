"""A real headless Chromium, as Debian packages it: what a page shows, and its complaints."""

from collections.abc import Callable, Iterator
import io
from pathlib import Path
import shutil
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
import pytest
from selenium.webdriver import Chrome, ChromeOptions, ChromeService

LAPTOP = (1280, 800)
PHONE = (390, 844)
BUDGET_S = 30.0  # for what takes a second on an idle machine
_FLAGS = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--disable-features=BackForwardCache',  # a page that was left shall end
    '--use-angle=swiftshader', '--enable-unsafe-swiftshader')  # WebGL without a graphics card


class Browser:
    """One Chromium with one page in it."""

    def __init__(self, profile: Path) -> None:
        chromium, driver = shutil.which('chromium'), shutil.which('chromedriver')
        assert chromium, "expected a chromium on the PATH: install Debian's package chromium"
        assert driver, 'expected a chromedriver on the PATH: install the package chromium-driver'
        options = ChromeOptions()
        options.binary_location = chromium
        for flag in (*_FLAGS, f'--user-data-dir={profile}'):
            options.add_argument(flag)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        self.driver = Chrome(options=options, service=ChromeService(driver))

    def prefer(self, scheme: str = 'light', motion: str = 'reduce') -> None:
        """Be someone who prefers light or dark, and to `reduce` motion or has `no-preference`."""
        self.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': [
            {'name': 'prefers-color-scheme', 'value': scheme},
            {'name': 'prefers-reduced-motion', 'value': motion}]})

    def open(self, url: str, size: tuple[int, int] = LAPTOP, scheme: str = 'light',
             motion: str = 'reduce') -> None:
        """Show a page at a size, (width, height) pixels; for the preferences see `prefer`."""
        width, height = size
        self.prefer(scheme, motion)
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', {
            'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': size == PHONE})
        self.driver.get('about:blank')
        self.errors()  # those of the page before
        self.driver.get(url)

    def errors(self) -> list[str]:
        """Return what the console has complained of since it was last asked."""
        return [entry['message'] for entry in self.driver.get_log('browser')
                if entry['level'] == 'SEVERE']

    def picture(self, path: Path | None = None) -> NDArray[np.uint8]:
        """Return what the window shows, (H, W, 3) RGB, and write it as PNG where a path is."""
        png = self.driver.get_screenshot_as_png()
        if path is not None:
            path.write_bytes(png)
        return np.asarray(Image.open(io.BytesIO(png)).convert('RGB'))

    def run(self, script: str, *arguments: Any) -> Any:
        """Run JavaScript in the page; return what it returns."""
        return self.driver.execute_script(script, *arguments)

    def text(self) -> str:
        """Return the words that the page shows."""
        return str(self.run('return document.body.innerText'))

    def until(self, condition: Callable[[], Any], what: str, budget_s: float = BUDGET_S) -> Any:
        """Wait until the condition holds; return what it returned."""
        deadline = time.monotonic() + budget_s
        while not (value := condition()):
            assert time.monotonic() < deadline, f'waited {budget_s} s in vain for {what}'
            time.sleep(0.05)
        return value


@pytest.fixture(scope='session')
def changed_share() -> Callable[..., float]:
    """Return a function of two pictures: the share of pixels that differ visibly."""
    return _changed_share


def _changed_share(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> float:
    apart = np.abs(before.astype(int) - after.astype(int)).max(axis=-1)
    return float((apart > 12).mean())


@pytest.fixture(scope='session')
def one_chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a Chromium that knows nothing of any other."""
    browser = Browser(tmp_path_factory.mktemp('chromium'))
    yield browser
    browser.driver.quit()


@pytest.fixture
def chromium(one_chromium: Browser) -> Iterator[Browser]:
    """Return the Chromium of the session, whose page is left when the test ends."""
    yield one_chromium
    one_chromium.driver.get('about:blank')
