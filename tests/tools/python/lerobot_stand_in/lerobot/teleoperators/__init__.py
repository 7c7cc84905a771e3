# SPDX-License-Identifier: Apache-2.0
"""A stand-in: see lerobot/__init__.py."""
