# SPDX-License-Identifier: Apache-2.0
"""A custom camera. It gives the pieces in a file with lines "KIND X Y", metres. own_camera.py FILE PORT"""

import sys
from pathlib import Path

import corbot


class ListedPieces:
    """A camera that reads a file instead of a picture; your own would find pieces in an image."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def look(self, timeout: float) -> list[corbot.Sighting]:
        """Give the pieces in the world frame of the cell."""
        rows = (line.split() for line in self.file.read_text().splitlines())
        return [corbot.Sighting(kind, corbot.Point(float(x), float(y), 0.0)) for kind, x, y in rows]

    def picture(self, marked: bool) -> bytes:
        """Refuse: there is no picture."""
        raise NotImplementedError("this camera takes no pictures")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: own_camera.py FILE PORT")
    corbot.serve_camera(ListedPieces(Path(sys.argv[1])), port=int(sys.argv[2]))
