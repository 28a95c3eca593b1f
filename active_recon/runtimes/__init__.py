"""What runs a network: one Protocol, and one module for each library that can."""

from active_recon.runtimes.base import (
    AUTO,
    DepthRuntime,
    load_depth_runtime,
    load_policy_runtime,
    load_runtime,
    load_segmenter_runtime,
    PolicyRuntime,
    REMARK,
    Runtime,
    RUNTIME_CHOICES,
    RUNTIMES,
    SegmenterRuntime,
    State,
)
from active_recon.runtimes.precision import PRECISIONS

__all__ = ['AUTO', 'DepthRuntime', 'PRECISIONS', 'PolicyRuntime', 'REMARK', 'RUNTIMES',
           'RUNTIME_CHOICES', 'Runtime', 'SegmenterRuntime', 'State', 'load_depth_runtime',
           'load_policy_runtime', 'load_runtime', 'load_segmenter_runtime']
