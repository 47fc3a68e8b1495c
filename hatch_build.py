"""What a package tells of the project, worked out when it is built.

A package page shows README away from its repository: its pictures and links have to lead to the
project's address, or to be words alone. The address stands in pyproject.toml, once there is one.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

LEADS = re.compile(
    r"(?P<picture>!?)\[(?P<words>[^\]]*)\]\((?!https?:|#|mailto:)(?P<path>[^)\s]+)\)"
)


class PackageMetadata(MetadataHookInterface):
    """Gives README as a package page can show it, and the project's addresses."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Fill in what pyproject.toml calls dynamic."""
        address = str(self.config.get("address", "")).rstrip("/")
        text = (Path(self.root) / "README.md").read_text("utf-8")
        version = str(metadata["version"])
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": as_on_a_package_page(text, address, version),
        }
        metadata["urls"] = addresses(address)


def addresses(address: str) -> dict[str, str]:
    """The project's pages, by the names that package pages know; none without an address."""
    if not address:
        return {}
    return {
        "Homepage": address,
        "Documentation": f"{address}/blob/main/docs",
        "Changelog": f"{address}/blob/main/CHANGELOG.md",
        "Issues": f"{address}/issues",
        "Source": address,
    }


def as_on_a_package_page(text: str, address: str, version: str) -> str:
    """README with pictures and links by absolute address; by words alone where there is none."""

    def led(found: re.Match[str]) -> str:
        picture, words, path = found["picture"], found["words"], found["path"]
        if not address:
            return "" if picture else words
        kind = "raw" if picture else "blob"
        return f"{picture}[{words}]({address}/{kind}/v{version}/{path})"

    return re.sub(r"\n{3,}", "\n\n", LEADS.sub(led, text))
