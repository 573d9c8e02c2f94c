"""A robot and its simulator in one picture."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from tests.screens import complaints_of
from tests.virtual.scene_data import HOSTILE, bare

from irtwin.report.page import content_policy
from irtwin.virtual.scene import apart_html

POSES = {"as it is": np.array([0.3, -0.2]), "with the robot's numbers": np.array([0.11, 0.19])}
PAGE = '<!DOCTYPE html><html><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{}">'
DRAWN = "() => [...document.querySelectorAll('.ia-picture img')].map(each => each.naturalWidth)"


def test_each_pose_has_a_picture_with_its_caption():
    html = str(apart_html(bare(), np.array([0.1, 0.2]), POSES).html)
    assert html.count('class="ia-picture"') == 2
    assert re.findall(r"<figcaption>(.*?)</figcaption>", html) == ["as it is", "with the robot&#39;s numbers"]
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])
    assert (data["robot"], data["simulators"]) == ([0.1, 0.2], [[0.3, -0.2], [0.11, 0.19]])


def test_a_name_stays_a_name():
    html = str(apart_html(bare(HOSTILE), np.array([0.1, 0.2]), {HOSTILE: np.zeros(2)}).html)
    assert "<script>window.hacked" not in html
    assert "<img src=x" not in html


@pytest.mark.system
def test_the_browser_draws_both(browser, tmp_path):
    fragment = apart_html(bare(), np.array([0.1, 0.2]), POSES)
    policy = content_policy(fragment.scripts)
    (tmp_path / "p.html").write_text(f"{PAGE.format(policy)}</head><body>{fragment.html}</body></html>")
    page = browser.new_page()
    complaints = complaints_of(page)
    page.goto((tmp_path / "p.html").as_uri())
    page.locator(".ia-picture img[src]").nth(1).wait_for(state="attached")
    assert all(width > 0 for width in page.evaluate(DRAWN))
    assert complaints == []
    page.close()
