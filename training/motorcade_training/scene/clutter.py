"""Things beside roads that are no vehicles, drawn over a crop: houses, their fronts, containers, signs, barriers, posts, lamps, railings, shrubs,
cabinets, and pieces of the picture itself upside down; some of them behind leaves. Pictures of motorways have few of them, and a network that has not seen them takes them for cars."""

from collections.abc import Callable

import cv2
import numpy as np

from motorcade_training.scene.texture import Bank

#: Share of crops that get clutter, and the most pieces a crop gets.
SHARE, MOST = 0.6, 4
#: Share of large pieces that are seen through leaves.
BEHIND_LEAVES = 0.35
#: Tries to place a piece where no vehicle is.
TRIES = 4

#: A piece: colours f32 [h, w, 3] and coverage f32 [h, w].
Piece = tuple[np.ndarray, np.ndarray]


def colour(random: np.random.Generator, low: float = 20, high: float = 235, tint: float = 0.12) -> np.ndarray:
    """A colour that is more or less grey."""
    return random.uniform(low, high) * (1 + random.normal(0, tint, 3))


def plane(random: np.random.Generator, bank: Bank, h: int, w: int, base: np.ndarray) -> np.ndarray:
    """A surface of one colour with some unevenness and a gradient of light."""
    light = 1 + random.uniform(0.01, 0.1) * bank.field(random, h, w)
    light = light * np.linspace(random.uniform(0.8, 1.2), random.uniform(0.8, 1.2), h, dtype=np.float32)[:, None]
    return base[None, None].astype(np.float32) * light[..., None]


def facade(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A wall with rows of windows, a door, sometimes an awning."""
    picture = plane(random, bank, h, w, colour(random, 60, 245))
    columns, rows = int(random.integers(1, 7)), int(random.integers(1, 4))
    glass, frame = colour(random, 10, 120), colour(random, 30, 250)
    for row in range(rows):
        for column in range(columns):
            if random.random() < 0.15:
                continue
            x1, x2 = (np.array([column + random.uniform(0.12, 0.2), column + random.uniform(0.8, 0.9)]) * w / columns).astype(int)
            y1, y2 = (np.array([row + 0.2, row + random.uniform(0.7, 0.85)]) * h / rows).astype(int)
            picture[y1:y2, x1:x2] = frame
            picture[y1 + 1 : y2 - 1, x1 + 1 : x2 - 1] = glass * random.uniform(0.7, 1.4)
    if random.random() < 0.4:
        x = int(random.uniform(0, 0.8) * w)
        picture[int(0.4 * h) :, x : x + max(w // 6, 2)] = colour(random, 15, 200, 0.4)
    if random.random() < 0.3:
        y = int(random.uniform(0, 0.3) * h)
        picture[y : y + max(h // 10, 1)] = colour(random, 30, 250, 0.5)
    return picture, np.ones((h, w), np.float32)


def house(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A front below a pitched roof, the gable or the eaves towards the road; the roof is lit otherwise than the wall."""
    ridge = max(int(h * random.uniform(0.2, 0.55)), 2)
    picture, cover = np.zeros((h, w, 3), np.float32), np.zeros((h, w), np.float32)
    wall, _ = facade(random, bank, max(h - ridge, 2), w)
    picture[h - len(wall) :], cover[h - len(wall) :] = wall, 1
    gable = random.random() < 0.4
    inset = 0.5 if gable else random.uniform(0.0, 0.3)
    corners = np.array([[0, ridge], [inset * w, 0], [(1 - inset) * w, 0], [w, ridge]]).astype(np.int32)
    roof = np.zeros((h, w), np.float32)
    cv2.fillPoly(roof, [corners], 1.0)
    if gable:
        # The wall goes on to the ridge; the roof shows as its two edges.
        picture[:ridge] = plane(random, bank, ridge, w, wall[0, 0])
        cv2.polylines(picture, [corners], False, colour(random, 20, 150).tolist(), max(h // 25, 1))
    else:
        tiles = np.array([170, 80, 55]) * random.uniform(0.5, 1.2) if random.random() < 0.5 else colour(random, 25, 150)
        picture[:ridge] = plane(random, bank, ridge, w, tiles)
        for _ in range(int(random.integers(0, 3))):
            y, x = int(random.uniform(0.3, 0.7) * ridge), int(random.uniform(0.2, 0.7) * w)
            picture[y : y + max(ridge // 4, 1), x : x + max(w // 12, 1)] = colour(random, 10, 230)
    return picture, np.maximum(cover, roof)


def barrier(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """Boards with stripes of two colours on feet: road works, level crossings."""
    picture, cover = np.zeros((h, w, 3), np.float32), np.zeros((h, w), np.float32)
    bright, stripe = colour(random, 160, 250), np.array([200, 40, 30]) * random.uniform(0.6, 1.2) if random.random() < 0.7 else colour(random, 10, 220, 0.5)
    period, slope = h * random.uniform(0.3, 1.5), random.choice([0.0, 1.0, -1.0])
    y, x = np.mgrid[:h, :w].astype(np.float32)
    striped = ((x + slope * y) % max(period, 2) < period / 2)[..., None]
    picture[:] = np.where(striped, stripe, bright)
    boards = int(random.integers(1, 4))
    for board in range(boards):
        top = int(board * h / boards)
        cover[top : top + max(int(h / boards * random.uniform(0.4, 0.9)), 1)] = 1
    foot = max(w // 30, 1)
    for column in np.linspace(0, max(w - foot, 0), int(random.integers(2, 6))).astype(int):
        picture[:, column : column + foot] = np.where(cover[:, column : column + foot, None] > 0, picture[:, column : column + foot], colour(random, 20, 160))
        cover[:, column : column + foot] = 1
    return picture, cover


def behind_leaves(random: np.random.Generator, bank: Bank, piece: Piece) -> Piece:
    """The piece with leaves before it: ragged dark gaps and patches of sun."""
    picture, cover = piece
    h, w = cover.shape
    leaves = cv2.resize(bank.ground(random), (max(w, 2), max(h, 2)), interpolation=cv2.INTER_AREA).astype(np.float32)
    field = bank.field(random, h, w) + 0.4 * random.standard_normal((h, w)).astype(np.float32)
    # More of them towards the ground, where hedges stand.
    field += np.linspace(random.uniform(-0.5, 0.5), random.uniform(0, 1.5), h, dtype=np.float32)[:, None]
    hidden = (field > random.uniform(-0.3, 1.0))[..., None]
    return np.where(hidden, leaves * random.uniform(0.1, 0.8), picture).astype(np.float32), cover


def container(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A box with ribs or panels."""
    picture = plane(random, bank, h, w, colour(random, 40, 245, 0.3))
    period = random.uniform(2, 12)
    ribs = 1 + random.uniform(0.03, 0.2) * np.sign(np.sin(2 * np.pi * np.arange(w) / period))
    picture *= ribs[None, :, None]
    picture[: max(h // 20, 1)] *= random.uniform(0.6, 1.3)
    picture[-max(h // 12, 1) :] *= random.uniform(0.2, 0.9)
    return picture, np.ones((h, w), np.float32)


def sign(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A board on one or two poles with strokes like writing."""
    picture, cover = np.zeros((h, w, 3), np.float32), np.zeros((h, w), np.float32)
    for x in ([0.5] if random.random() < 0.5 else [0.2, 0.8]):
        column = int(x * (w - 1))
        thick = max(w // 20, 1)
        picture[:, column : column + thick] = colour(random, 50, 190)
        cover[:, column : column + thick] = 1
    low = int(h * random.uniform(0.3, 0.8)) + 1
    board = plane(random, bank, low, w, colour(random, 30, 250, 0.5))
    ink = colour(random, 0, 255)
    if random.random() < 0.4:
        # A field of another colour along one side, as boards of firms and station signs have.
        share = random.uniform(0.15, 0.5)
        field = (slice(0, max(int(share * low), 1)), slice(None)) if random.random() < 0.5 else (slice(None), slice(0, max(int(share * w), 1)))
        board[field] = colour(random, 20, 240, 0.5)
    for _ in range(int(random.integers(0, 5))):
        y, x = int(random.uniform(0.1, 0.8) * low), int(random.uniform(0.05, 0.4) * w)
        length = int(random.uniform(0.2, 0.6) * w)
        marks = random.random(length) < 0.7
        board[y : y + max(low // 9, 1), x : x + length][:, marks[: max(w - x, 0)]] = ink
    if random.random() < 0.3:
        disc = np.zeros((low, w), np.float32)
        cv2.ellipse(disc, (w // 2, low // 2), (w // 2, low // 2), 0, 0, 360, 1.0, -1)
        cover[:low] = np.maximum(cover[:low], disc)
        picture[:low] = np.where(disc[..., None] > 0, board, picture[:low])
    else:
        picture[:low], cover[:low] = board, 1
    return picture, cover


def posts(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A row of posts, cones or bollards with bands and reflectors."""
    picture, cover = np.zeros((h, w, 3), np.float32), np.zeros((h, w), np.float32)
    paint, band = colour(random, 90, 250, 0.3), colour(random, 5, 255, 0.6)
    thick = max(int(h * random.uniform(0.06, 0.3)), 2)
    taper = random.uniform(0, 0.8)
    for x in range(0, max(w - thick, 1), max(int(thick * random.uniform(2, 9)), 1)):
        for y in range(h):
            inset = int(taper * thick * (1 - y / h) / 2)
            picture[y, x + inset : x + thick - inset] = paint * (0.8 + 0.3 * random.random())
            cover[y, x + inset : x + thick - inset] = 1
        y = int(random.uniform(0.05, 0.5) * h)
        picture[y : y + max(h // 8, 1), x : x + thick] = band
    return picture, cover


def lamps(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A dark box with lit discs: traffic lights, warning lights."""
    picture = plane(random, bank, h, w, colour(random, 8, 70))
    upright = random.random() < 0.7
    count = int(random.integers(2, 4))
    for number in range(count):
        along = (number + 0.5) / count
        centre = (int(0.5 * w), int(along * h)) if upright else (int(along * w), int(0.5 * h))
        radius = max(int(0.4 * min((w, h / count) if upright else (w / count, h))), 1)
        lit = random.random() < 0.5
        tint = [(255, 60, 40), (255, 190, 40), (60, 255, 140)][int(random.integers(3))]
        cv2.circle(picture, centre, radius, tuple(float(v) * (1.0 if lit else 0.2) for v in tint), -1)
    return picture, np.ones((h, w), np.float32)


def railing(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """Bars and posts, or the beam of a barrier."""
    picture = plane(random, bank, h, w, colour(random, 40, 230))
    cover = np.zeros((h, w), np.float32)
    if random.random() < 0.5:
        beam = slice(int(random.uniform(0, 0.3) * h), int(random.uniform(0.4, 0.8) * h) + 1)
        profile = 1 + 0.3 * np.sin(np.linspace(0, random.uniform(4, 14), beam.stop - beam.start))
        picture[beam] *= profile[:, None, None].astype(np.float32)
        cover[beam] = 1
    else:
        for y in np.linspace(0, h - 1, int(random.integers(2, 6))).astype(int):
            cover[y : y + max(h // 20, 1)] = 1
    cover[:, :: max(int(h * random.uniform(0.2, 1.5)), 2)] = 1
    return picture, cover


def shrub(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """Overlapping blobs of leaves, darker below."""
    texture = cv2.resize(bank.ground(random), (max(w, 2), max(h, 2)), interpolation=cv2.INTER_AREA).astype(np.float32)
    cover = np.zeros((h, w), np.float32)
    for _ in range(int(random.integers(2, 12))):
        centre = (int(random.uniform(0.15, 0.85) * w), int(random.uniform(0.3, 1.0) * h))
        axes = (max(int(random.uniform(0.1, 0.35) * w), 1), max(int(random.uniform(0.15, 0.5) * h), 1))
        cv2.ellipse(cover, centre, axes, random.uniform(0, 180), 0, 360, 1.0, -1)
    ragged = cover * (bank.field(random, h, w) > random.uniform(-3, -0.8))
    shade = np.linspace(random.uniform(0.7, 1.2), random.uniform(0.2, 0.8), h, dtype=np.float32)
    return texture * shade[:, None, None], ragged.astype(np.float32)


def cabinet(random: np.random.Generator, bank: Bank, h: int, w: int) -> Piece:
    """A box on the ground with doors and a dark foot: cabinets, bins, kiosks, stones."""
    picture = plane(random, bank, h, w, colour(random, 25, 230, 0.2))
    for x in np.linspace(0, w - 1, int(random.integers(2, 5))).astype(int):
        picture[:, x : x + 1] *= 0.6
    picture[: max(int(random.uniform(0.03, 0.25) * h), 1)] *= random.uniform(0.6, 1.4)
    foot = max(int(random.uniform(0.03, 0.2) * h), 1)
    picture[-foot:] *= random.uniform(0.1, 0.7)
    cover = np.ones((h, w), np.float32)
    if random.random() < 0.3:
        cv2.ellipse(cover, (w // 2, h // 2), (w // 2, h // 2), 0, 0, 360, 2.0, -1)
        cover = np.clip(cover - 1, 0, 1)
    return picture, cover


def turned(random: np.random.Generator, source: np.ndarray, boxes: np.ndarray, h: int, w: int) -> Piece | None:
    """A piece of the picture without vehicles, upside down or on its side."""
    high, wide = source.shape[:2]
    for _ in range(TRIES):
        y, x = int(random.uniform(0, max(high - h, 1))), int(random.uniform(0, max(wide - w, 1)))
        if free(boxes, x, y, min(x + w, wide), min(y + h, high)):
            part = source[y : y + h, x : x + w]
            part = part[::-1] if random.random() < 0.6 else np.rot90(part, 1 if random.random() < 0.5 else 3)
            return cv2.resize(np.ascontiguousarray(part), (w, h)).astype(np.float32), np.ones((h, w), np.float32)
    return None


#: Kinds, their share, and ranges of height [px] and of width over height.
KINDS: tuple[tuple[Callable[..., Piece], float, tuple[float, float], tuple[float, float]], ...] = (
    (facade, 0.14, (14, 120), (0.5, 3.0)),
    (house, 0.16, (14, 150), (0.6, 3.0)),
    (barrier, 0.05, (6, 50), (0.8, 6.0)),
    (container, 0.10, (10, 90), (0.7, 3.5)),
    (sign, 0.12, (10, 90), (0.3, 2.0)),
    (posts, 0.12, (6, 50), (0.15, 6.0)),
    (lamps, 0.08, (6, 50), (0.3, 1.4)),
    (railing, 0.10, (8, 60), (1.0, 8.0)),
    (shrub, 0.16, (10, 120), (0.6, 2.5)),
    (cabinet, 0.10, (8, 70), (0.5, 1.8)),
)
TURNED = 0.2
#: Kinds that may stand behind leaves.
LARGE = (facade, house, container, sign, cabinet)


def free(boxes: np.ndarray, x1: int, y1: int, x2: int, y2: int) -> bool:
    """Whether no box meets the rectangle."""
    return bool(((boxes[:, 0] > x2) | (boxes[:, 2] < x1) | (boxes[:, 1] > y2) | (boxes[:, 3] < y1)).all())


def scatter(image: np.ndarray, boxes: np.ndarray, road: np.ndarray, bank: Bank, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Image and road (255 x probability, same size) with pieces over them where no vehicle is."""
    if random.random() >= SHARE:
        return image, road
    height, width = image.shape[:2]
    source, image, road = image, image.copy(), road.copy()
    # Things in a dark picture are dark.
    light = np.clip(float(source.mean()) / 110, 0.25, 1.3)
    shares = np.array([kind[1] for kind in KINDS])
    for _ in range(int(random.integers(1, MOST + 1))):
        make, _, heights, aspects = KINDS[int(random.choice(len(KINDS), p=shares / shares.sum()))]
        h = min(int(np.exp(random.uniform(*np.log(heights)))), int(0.6 * height))
        w = int(np.clip(h * np.exp(random.uniform(*np.log(aspects))), 3, 0.8 * width))
        for _ in range(TRIES):
            x, y = int(random.uniform(-0.3 * w, width - 0.7 * w)), int(random.uniform(0.1 * height, 0.75 * height - 0.5 * h))
            x1, y1, x2, y2 = max(x, 0), max(y, 0), min(x + w, width), min(y + h, height)
            if free(boxes, x1, y1, x2, y2) and x2 > x1 + 2 and y2 > y1 + 2:
                break
        else:
            continue
        piece = turned(random, source, boxes, h, w) if random.random() < TURNED else None
        if piece is None:
            picture, cover = make(random, bank, h, w)
            if make in LARGE and random.random() < BEHIND_LEAVES:
                picture, cover = behind_leaves(random, bank, (picture, cover))
            piece = light * random.uniform(0.7, 1.4) * picture, cover
        picture, cover = (part[y1 - y : y2 - y, x1 - x : x2 - x] for part in piece)
        if random.random() < 0.5:
            cover = cv2.blur(np.ascontiguousarray(cover), (2, 2))
        under = image[y1:y2, x1:x2]
        image[y1:y2, x1:x2] = np.clip(under + (picture - under) * cover[..., None], 0, 255).astype(np.uint8)
        road[y1:y2, x1:x2] = (road[y1:y2, x1:x2] * (1 - cover)).astype(road.dtype)
    return image, road
