"""The page for the customer as a browser prints it: one A4 sheet for each drive."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.session.test_report_page import wide_page
from tui.session.report_page import pages_html

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
A4 = (595, 842)
"""Width and height in points."""


@pytest.mark.sweep
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_each_page_prints_on_one_a4_sheet(tmp_path: Path) -> None:
    page, pdf = tmp_path / "page.html", tmp_path / "page.pdf"
    page.write_text(pages_html([wide_page()] * 3), "utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]
    places = [f"--user-data-dir={tmp_path / 'browser'}", f"--print-to-pdf={pdf}", page.as_uri()]
    subprocess.run([str(CHROMIUM), *options, *places], check=True, timeout=60, capture_output=True)
    printed = pdf.read_bytes()
    assert re.findall(rb"/Count (\d+)", printed) == [b"3"]
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", printed)
    assert boxes
    assert all((round(float(w)), round(float(h))) == A4 for w, h in boxes)
