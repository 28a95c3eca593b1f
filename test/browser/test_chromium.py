"""The browser that the page tests rely on: it draws, it runs WebGL, and it hears complaints."""

import pytest

pytestmark = pytest.mark.browser


def test_a_page_is_drawn_and_a_change_of_it_is_seen(chromium, changed_share):
    chromium.open('data:text/html,<body style="background:white">quiet')
    before = chromium.picture()
    chromium.run('document.body.style.background = "black"')
    assert chromium.text() == 'quiet'
    assert changed_share(before, before) == 0
    assert changed_share(before, chromium.picture()) > 0.9


def test_an_error_of_a_script_is_heard_once(chromium):
    chromium.open('data:text/html,<script>throw new Error("broken")</script>')
    assert 'broken' in chromium.errors()[0]
    assert not chromium.errors()


def test_webgl_runs_without_a_graphics_card(chromium):
    chromium.open('data:text/html,<canvas></canvas>')
    assert chromium.run('return !!document.querySelector("canvas").getContext("webgl2")')
