"""Changes of light, camera and compression."""

import cv2
import numpy as np

from motorcade_training.scene.texture import Bank


def shadows(image: np.ndarray, bank: Bank, random: np.random.Generator) -> np.ndarray:
    """Shadows of things out of sight: parts of the image darker, with soft or hard edges."""
    height, width = image.shape[:2]
    field = bank.field(random, height, width)
    edge = random.uniform(1, 12)
    share = 1 / (1 + np.exp(-edge * (field - random.uniform(-0.5, 1.0))))
    factor = 1 - share * random.uniform(0.2, 0.75)
    return np.clip(image * factor[..., None], 0, 255).astype(np.uint8)


def distort(image: np.ndarray, bank: Bank, random: np.random.Generator) -> np.ndarray:
    """Light, colour, blur, noise and JPEG artefacts at random; u8 [H, W, 3], RGB."""
    if random.random() < 0.3:
        image = shadows(image, bank, random)
    if random.random() < 0.8:
        gamma, gain, lift = np.exp(random.normal(0, 0.2)), random.uniform(0.8, 1.25), random.uniform(-12, 12)
        levels = np.arange(256) / 255
        table = np.clip(levels**gamma * 255 * gain + lift, 0, 255)
        if random.random() < 0.3:
            # An S curve, as cameras with much contrast have.
            table = table + random.uniform(-10, 25) * np.sin((np.clip(table, 0, 255) / 255 - 0.5) * 2 * np.pi)
        table = np.clip(table[:, None] * random.uniform(0.9, 1.1, 3), 0, 255).astype(np.uint8)
        image = cv2.LUT(image, np.ascontiguousarray(table.reshape(1, 256, 3)))
    kind = random.random()
    if kind < 0.15:
        image = np.repeat(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[..., None], 3, 2)
    elif kind < 0.5:
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[..., None]
        share = random.uniform(0.3, 1.6)
        image = cv2.addWeighted(image, share, np.repeat(grey, 3, 2), 1 - share, 0)
    kind = random.random()
    if kind < 0.12:
        image = cv2.GaussianBlur(image, (0, 0), random.uniform(0.4, 1.6))
    elif kind < 0.35:
        soft = cv2.GaussianBlur(image, (0, 0), 1.2)
        amount = random.uniform(0.2, 0.9)
        image = cv2.addWeighted(image, 1 + amount, soft, -amount, 0)
    if random.random() < 0.25:
        field = np.empty(image.shape, np.int16)
        cv2.setRNGSeed(int(random.integers(1 << 31)))
        cv2.randn(field, 0, random.uniform(2, 10))
        image = cv2.add(image, field, dtype=cv2.CV_8U)
    if random.random() < 0.2:
        _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, int(random.integers(25, 85))])
        image = cv2.imdecode(packed, cv2.IMREAD_COLOR)
    return image
