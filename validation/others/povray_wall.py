"""What POV-Ray shows at a pixel through Jaramillo's folding pair: python -m validation.others.povray_wall.

The wall is a cylinder of radius 1500 mm whose tone rises with height, -400 mm black and 400 mm white, in 16 bits. The
camera has 1600 x 1200 pixels of 0.0044 mm and f = 8 mm; pixel (799, 409) is 0.5 left of its axis and 190.5 above.
"""

import struct
import subprocess
import tempfile
import zlib
from pathlib import Path

SCENE = """
#version 3.7;
global_settings {{ assumed_gamma 1.0 max_trace_level 8 }}
camera {{ perspective location <0, 0, 0> direction <0, 0, 8> right <7.04, 0, 0> up <0, 5.28, 0> }}
#declare Shine = texture {{ pigment {{ rgb 0 }} finish {{ ambient 0 diffuse 0 reflection 1 }} }}
plane {{ z, 116.842 texture {{ Shine }} clipped_by {{ cylinder {{ <0, 0, 116>, <0, 0, 118>, 17.226 }} }} }}
quadric {{ <{c}, {c}, {ck}>, <0, 0, 0>, <0, 0, -2>, 0 texture {{ Shine }}
  clipped_by {{ difference {{ cylinder {{ <0, 0, -60>, <0, 0, 0.01>, 37 }}
                              cylinder {{ <0, 0, -61>, <0, 0, 1>, 3.392 }} }} }} translate <0, 0, 5.0002> }}
cylinder {{ <0, 0, -400>, <0, 0, 400>, 1500 open
  pigment {{ gradient z color_map {{ [0 rgb 0] [1 rgb 1] }} scale 800 translate <0, 0, -400> }}
  finish {{ ambient 0 diffuse 0 emission 1 }} }}
"""


def samples(data: bytes) -> tuple[int, int, list[bytes]]:
    """Width, channels and unfiltered rows of a PNG of 16 bits."""
    chunks, at = {}, 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        chunks[kind] = chunks.get(kind, b"") + data[at + 8 : at + 8 + length]
        at += 12 + length
    width, height, depth, colour = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert depth == 16
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    size, raw, rows = width * channels * 2, zlib.decompress(chunks[b"IDAT"]), []
    previous = bytearray(size)
    for row in range(height):
        start = row * (size + 1)
        rule, line = raw[start], bytearray(raw[start + 1 : start + 1 + size])
        step = channels * 2
        for i in range(size):
            left = line[i - step] if i >= step else 0
            up, corner = previous[i], previous[i - step] if i >= step else 0
            guess = left + up - corner
            nearest = min((left, up, corner), key=lambda value: abs(guess - value))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, nearest)[rule]) & 255
        rows.append(bytes(line))
        previous = line
    return width, channels, rows


with tempfile.TemporaryDirectory() as folder:
    curvature = 1.0 / -27.83526
    text = SCENE.format(c=f"{curvature:.15g}", ck=f"{curvature * (1.0 - 1.258254):.15g}")
    Path(folder, "scene.pov").write_text(text, encoding="utf-8")
    words = ["povray", "+Iscene.pov", "+Oscene.png", "+FN16", "-D", "-A", "File_Gamma=1.0", "+W1600", "+H1200"]
    log = subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True).stderr
    _, channels, rows = samples(Path(folder, "scene.png").read_bytes())
place = 799 * channels * 2
tone = int.from_bytes(rows[409][place : place + 2], "big")
print(next(line for line in log.splitlines() if "POV-Ray" in line or "Version" in line))
print("tone", tone, f"height {tone / 65535.0 * 800.0 - 400.0:.3f}")
