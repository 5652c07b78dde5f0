"""Pages as a browser shows them: a script's answer about a page, in Debian's Chromium without a window."""

import html
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

# No look-ups of its own: a page is looked at, nothing else.
OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars",
)


def answer(page, script, width=1280, dark=False):
    """The value of a JavaScript expression (a function body with `return`) in a page, after it is loaded."""
    program = shutil.which("chromium")
    if not program:
        pytest.skip("chromium is not installed (Debian's package chromium)")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "page.html"
        ask = (
            "<script>addEventListener('load', () => { let reply; try { reply = (() => {" + script + "})(); } catch (e) { reply = {error: String(e)}; }"
            "const box = document.createElement('pre'); box.id = 'reply'; box.textContent = JSON.stringify(reply); document.body.append(box); });</script>"
        )
        copy.write_text(Path(page).read_text().replace("</body>", ask + "</body>"))
        scheme = ["--blink-settings=preferredColorScheme=0"] if dark else []
        command = [program, *OPTIONS, *scheme, f"--window-size={width},900", f"--user-data-dir={folder}/user", "--dump-dom", copy.as_uri()]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        found = re.search(r'<pre id="reply">(.*?)</pre>', done.stdout, re.S)
        assert found, done.stderr[-2000:]
        reply = json.loads(html.unescape(found.group(1)))
        assert not (isinstance(reply, dict) and "error" in reply), reply
        return reply
