"""The SROS 2 policy of a graph."""

from xml.etree import ElementTree

from pose_fusion.nodes.policy import policy_xml


def test_each_node_is_permitted_exactly_its_topics_and_services():
    nodes = {
        ("/", "fusion"): {
            ("topic", "publish"): ["/tf", "/humans/bodies/subject/joint_states"],
            ("topic", "subscribe"): ["/kinect_left/skeletons"],
            ("service", "reply"): ["/fusion/set_parameters"],
            ("service", "request"): [],
        },
        ("/lab", "viewer"): {
            ("topic", "subscribe"): ["/lab/a", "/tf"],
            ("service", "request"): ["/lab/r/start"],
        },
    }

    policy = ElementTree.fromstring(policy_xml(nodes, "/pose").split("\n", 1)[1])

    (enclave,) = policy.iter("enclave")
    assert enclave.get("path") == "/pose"
    fusion, viewer = policy.iter("profile")
    assert (fusion.get("ns"), fusion.get("node")) == ("/", "fusion")
    said = [(rule.tag, rule.attrib, [each.text for each in rule]) for rule in fusion]
    assert said == [
        ("topics", {"publish": "ALLOW"}, ["humans/bodies/subject/joint_states", "tf"]),
        ("topics", {"subscribe": "ALLOW"}, ["kinect_left/skeletons"]),
        ("services", {"reply": "ALLOW"}, ["fusion/set_parameters"]),
    ]
    said = [(rule.tag, rule.attrib, [each.text for each in rule]) for rule in viewer]
    assert said == [
        ("topics", {"subscribe": "ALLOW"}, ["/tf", "a"]),
        ("services", {"request": "ALLOW"}, ["r/start"]),
    ]


def test_names_are_escaped_in_xml():
    text = policy_xml({("/", 'a"<b>'): {("topic", "publish"): ["/<x>&"]}}, "/pose")

    assert ElementTree.fromstring(text.split("\n", 1)[1]).find(".//topic").text == "<x>&"
