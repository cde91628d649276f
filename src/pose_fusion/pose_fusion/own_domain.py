"""A ROS domain of its own for a graph."""

import os
import socket

from rich.console import Console

FIRST_DOMAIN, DOMAINS = 1, 100  # beside 0, where graphs are that set none


def use_own_domain(console: Console) -> None:
    """Use a free ROS domain, without topics of other graphs, unless ``ROS_DOMAIN_ID`` is set."""
    if os.environ.get("ROS_DOMAIN_ID"):
        return
    begin = os.getpid()
    every = [FIRST_DOMAIN + (begin + step) % DOMAINS for step in range(DOMAINS)]
    domain = next(filter(_is_free, every), every[0])
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    console.print(
        f"ROS domain {domain}; to see its topics from another terminal, first "
        f"'export ROS_DOMAIN_ID={domain}' there"
    )


def _is_free(domain: int) -> bool:
    """Whether no process on this host listens for others in a ROS domain."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        try:
            listener.bind(("", 7400 + 250 * domain))  # of discovery, by the DDSI-RTPS standard
        except OSError:
            return False
    return True
