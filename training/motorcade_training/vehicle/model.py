"""The network: an hourglass of plain 3x3 convolutions with ReLU and nearest resize.

Input `crop` (N, 4, 64, 64): normalised RGB and a plane of log(box width / box height). Outputs: `heatmaps` (N, 36, 16, 16) logits,
`visibility` (N, 36) logits, `heading` (N, 24) logits, `body` (N, 9) logits, `dimensions` (N, 6): log ratios of length,
width, height to the mean dimensions and the logarithms of their variances, `presence` (N, 1): logit that the box shows a vehicle.
"""

import torch
from torch import nn
from torch.nn import functional

from motorcade_training.vehicle.layout import BODIES, HEADING_BINS, KEYPOINTS

OUTPUTS = ["heatmaps", "visibility", "heading", "body", "dimensions", "presence"]
#: Features that the presence is told from: the squeezed map and the trunk, means and maxima of finer maps.
PRESENCE_FEATURES = 48 * 16 + 96 + 128 + 128 + 64


class Block(nn.Sequential):
    """Convolution, batch normalisation, ReLU."""

    def __init__(self, inputs: int, outputs: int, kernel: int = 3, stride: int = 1):
        super().__init__(
            nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(inplace=True),
        )


class Stage(nn.Module):
    """Halves the resolution, then one residual convolution."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        self.down = Block(inputs, outputs, stride=2)
        self.same = Block(outputs, outputs)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = self.down(x)
        return x + self.same(x)


class VehicleNet(nn.Module):
    """See the module's documentation; 0.88 M parameters."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Sequential(Block(4, 24, stride=2), Block(24, 32))
        self.down16 = Stage(32, 64)
        self.down8 = Stage(64, 128)
        self.down4 = Stage(128, 128)
        self.lateral4 = Block(128, 128, kernel=1)
        self.merge8 = Block(128, 64)
        self.merge16 = Block(64, 64)
        self.heat = nn.Conv2d(64, KEYPOINTS, 1)
        self.local_visibility = nn.Conv2d(64, KEYPOINTS, 1)
        self.squeeze = Block(128, 48, kernel=1)
        self.trunk = nn.Sequential(nn.Flatten(), nn.Linear(48 * 16, 96), nn.ReLU(inplace=True))
        self.global_visibility = nn.Linear(96, KEYPOINTS)
        self.heading = nn.Linear(96, HEADING_BINS)
        self.body = nn.Linear(96, len(BODIES))
        self.dimensions = nn.Linear(96, 6)
        self.presence = nn.Sequential(nn.Linear(PRESENCE_FEATURES, 64), nn.ReLU(inplace=True), nn.Linear(64, 1))

    def encode(self, crop: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Maps at 16x16, 8x8 and 4x4."""
        at16 = self.down16(self.stem(crop))
        at8 = self.down8(at16)
        return at16, at8, self.down4(at8)

    def presence_features(self, at16: torch.Tensor, at8: torch.Tensor, at4: torch.Tensor) -> torch.Tensor:
        """(N, PRESENCE_FEATURES)."""
        squeezed = self.squeeze(at4)
        pooled = [at8.mean(dim=(2, 3)), at8.amax(dim=(2, 3)), at16.mean(dim=(2, 3))]
        return torch.cat([squeezed.flatten(1), self.trunk(squeezed), *pooled], dim=1)

    def forward(self, crop: torch.Tensor) -> tuple[torch.Tensor, ...]:
        at16, at8, at4 = self.encode(crop)
        up = functional.interpolate(self.lateral4(at4), scale_factor=2.0, mode="nearest")
        up = self.merge8(at8 + up)
        up = functional.interpolate(up, scale_factor=2.0, mode="nearest")
        features = self.merge16(at16 + up)
        heat = self.heat(features)
        # A keypoint's visibility is read where the keypoint is.
        place = torch.softmax(heat.flatten(2), dim=2)
        local = (place * self.local_visibility(features).flatten(2)).sum(dim=2)
        evidence = self.presence_features(at16, at8, at4)
        trunk = evidence[:, 48 * 16 : 48 * 16 + 96]
        visibility = local + self.global_visibility(trunk)
        return heat, visibility, self.heading(trunk), self.body(trunk), self.dimensions(trunk), self.presence(evidence)


def parameters(model: nn.Module) -> int:
    """Number of weights."""
    return sum(p.numel() for p in model.parameters())
