# SPDX-License-Identifier: Apache-2.0
"""A stand-in: the registry of configurations."""

from dataclasses import dataclass
from typing import Any, Callable, Dict, Optional


@dataclass
class TeleoperatorConfig:
    id: Optional[str] = None

    known = {}  # type: Dict[str, Any]

    @classmethod
    def register_subclass(cls, name: str) -> Callable[[Any], Any]:
        def register(config: Any) -> Any:
            cls.known[name] = config
            return config

        return register
