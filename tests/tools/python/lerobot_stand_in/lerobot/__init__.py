# SPDX-License-Identifier: Apache-2.0
"""A stand-in for LeRobot: the part of it that a teleoperator is written against, for tests without it."""
