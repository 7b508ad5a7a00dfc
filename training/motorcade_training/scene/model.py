"""The scene network: plain 3x3 convolutions, one backbone, heads for boxes at strides 8 and 16 and for the road at stride 4."""

from dataclasses import asdict, dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.fusion import fuse_conv_bn_eval

from motorcade_training.scene.classes import CLASSES

#: Strides of the two box heads [px].
BOX_STRIDES = (8, 16)
ROAD_STRIDE = 4
#: Sides of the input are multiples of this [px].
INPUT_MULTIPLE = 32
#: Score every cell starts with, so that the first steps are not spent on the background.
PRIOR = 0.01


@dataclass(frozen=True)
class Shape:
    """Widths and depths of the network."""

    #: Channels at strides 2, 4, 8, 16, 32.
    widths: tuple[int, int, int, int, int] = (16, 24, 48, 96, 160)
    #: Residual blocks at strides 4, 8, 16, 32.
    blocks: tuple[int, int, int, int] = (0, 1, 3, 2)
    #: Channels of the pyramid at strides 8 and 16, and of the box heads.
    neck: int = 48
    #: Channels of the road head at stride 4.
    road: int = 16

    def to_dict(self) -> dict:
        """For checkpoints."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict) -> "Shape":
        """From a checkpoint."""
        return cls(**{k: tuple(v) if isinstance(v, (list, tuple)) else v for k, v in values.items()})


class Conv(nn.Module):
    """Convolution, batch normalisation and, unless `linear`, ReLU."""

    def __init__(self, inputs: int, outputs: int, kernel: int = 3, stride: int = 1, linear: bool = False):
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
        self.norm: nn.Module = nn.BatchNorm2d(outputs, eps=1e-3, momentum=0.03)
        self.linear = linear

    def forward(self, x: Tensor) -> Tensor:
        x = self.norm(self.conv(x))
        return x if self.linear else F.relu(x, inplace=True)

    def fuse(self) -> None:
        """Folds the normalisation into the convolution; for export."""
        if isinstance(self.norm, nn.BatchNorm2d):
            self.conv = fuse_conv_bn_eval(self.conv.eval(), self.norm.eval())
            self.norm = nn.Identity()


class Residual(nn.Module):
    """Two convolutions beside a shortcut."""

    def __init__(self, width: int):
        super().__init__()
        self.first, self.second = Conv(width, width), Conv(width, width, linear=True)

    def forward(self, x: Tensor) -> Tensor:
        return F.relu(x + self.second(self.first(x)))


class BoxHead(nn.Module):
    """Class logits and the logarithms of the distances to the edges in strides."""

    def __init__(self, width: int):
        super().__init__()
        self.score_trunk, self.edge_trunk = Conv(width, width), Conv(width, width)
        self.score, self.edge = nn.Conv2d(width, len(CLASSES), 1), nn.Conv2d(width, 4, 1)
        nn.init.constant_(self.score.bias, torch.logit(torch.tensor(PRIOR)).item())
        nn.init.normal_(self.score.weight, std=0.01)
        nn.init.normal_(self.edge.weight, std=0.01)
        nn.init.constant_(self.edge.bias, 0.7)

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        return self.score(self.score_trunk(x)), self.edge(self.edge_trunk(x))


class SceneNetwork(nn.Module):
    """RGB in [0, 1], f32 [B, 3, H, W], to raw outputs; see `Exported` for the outputs of the file."""

    def __init__(self, shape: Shape = Shape()):
        super().__init__()
        self.shape = shape
        w2, w4, w8, w16, w32 = shape.widths
        b4, b8, b16, b32 = shape.blocks
        stage = lambda a, b, n: nn.Sequential(Conv(a, b, stride=2), *(Residual(b) for _ in range(n)))  # noqa: E731
        self.stem = Conv(3, w2, stride=2)
        self.stage4, self.stage8 = stage(w2, w4, b4), stage(w4, w8, b8)
        self.stage16, self.stage32 = stage(w8, w16, b16), stage(w16, w32, b32)
        neck = shape.neck
        self.from32, self.from16, self.from8 = (Conv(w, neck, 1, linear=True) for w in (w32, w16, w8))
        self.smooth16, self.smooth8 = Conv(neck, neck), Conv(neck, neck)
        self.heads = nn.ModuleList([BoxHead(neck), BoxHead(neck)])
        self.road8, self.road4 = Conv(neck, shape.road, 1, linear=True), Conv(w4, shape.road, 1, linear=True)
        self.road_trunk, self.road = Conv(shape.road, shape.road), nn.Conv2d(shape.road, 1, 1)

    def forward(self, x: Tensor) -> tuple[list[tuple[Tensor, Tensor]], Tensor]:
        """Per stride: class logits [B, C, h, w] and log distances [B, 4, h, w]; road logits [B, 1, H/4, W/4]."""
        c4 = self.stage4(self.stem(x))
        c8 = self.stage8(c4)
        c16 = self.stage16(c8)
        p16 = self.smooth16(F.relu(self.from16(c16) + double(self.from32(self.stage32(c16)))))
        p8 = self.smooth8(F.relu(self.from8(c8) + double(p16)))
        road = self.road_trunk(F.relu(self.road4(c4) + double(self.road8(p8))))
        return [head(p) for head, p in zip(self.heads, (p8, p16))], self.road(road)

    def fuse(self) -> "SceneNetwork":
        """Folds all normalisations, in place."""
        for module in self.modules():
            if isinstance(module, Conv):
                module.fuse()
        return self


class Exported(nn.Module):
    """The network with the outputs of the ONNX file.

    boxes8 [1, C + 4, H/8, W/8] and boxes16 [1, C + 4, H/16, W/16]: C class scores 0..1, then the distances in input pixels
    from the centre of the cell, ((x + 0.5) s, (y + 0.5) s), to the left, upper, right and lower edge.
    road [1, 1, H/4, W/4]: probability of road.
    """

    def __init__(self, network: SceneNetwork):
        super().__init__()
        self.network = network

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        heads, road = self.network(x)
        boxes = [torch.cat([s.sigmoid(), e.exp() * stride], 1) for (s, e), stride in zip(heads, BOX_STRIDES)]
        return boxes[0], boxes[1], road.sigmoid()


def double(x: Tensor) -> Tensor:
    """Nearest-neighbour enlargement by two."""
    return F.interpolate(x, scale_factor=2.0, mode="nearest")


def parameters(module: nn.Module) -> int:
    """Number of weights."""
    return sum(p.numel() for p in module.parameters())
