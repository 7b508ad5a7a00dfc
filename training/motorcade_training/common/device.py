"""Device and precision of a training."""

import os

import torch


def pick_device(name: str = "auto", threads: int = 1) -> torch.device:
    """`auto`: a GPU where there is one, else the CPU with `threads` threads."""
    torch.set_num_threads(threads)
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    return torch.device(name)


def has_fast_bf16(device: torch.device) -> bool:
    """bf16 autocast pays on GPUs and on CPUs with AVX512-BF16 or AMX; on others it is many times slower than f32."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported()
    if not os.path.exists("/proc/cpuinfo"):
        return False
    with open("/proc/cpuinfo") as file:
        flags = next((line for line in file if line.startswith("flags")), "").split()
    return "avx512_bf16" in flags or "amx_bf16" in flags
