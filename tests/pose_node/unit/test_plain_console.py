import io

from rich.console import Console

from pose_node.plain_console import waiting_bar


def shown(*, is_terminal):
    file = io.StringIO()
    with waiting_bar(Console(file=file, force_terminal=is_terminal), "reading"):
        pass
    return file.getvalue()


def test_a_wait_is_shown_on_a_terminal_and_not_in_a_file():
    assert "reading" in shown(is_terminal=True)
    assert "%" not in shown(is_terminal=True)
    assert not shown(is_terminal=False).strip()
