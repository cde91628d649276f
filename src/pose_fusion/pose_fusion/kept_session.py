"""What the fusion node has found and continues with after a crash."""

from functools import partial
from pathlib import Path

from pose_calibration.imus.section import alignments_document, read_alignments
from pose_core.api import (
    BodyModel,
    BodyShape,
    Pipeline,
    SensorsToSegments,
    load_body_shape,
    save_body_shape,
)
from pose_fusion.parameters import FusionNodeParameters
from pose_node.kept import Kept, kept_file


class KeptSession:
    """The chosen person, the subject's body shape and the IMUs' alignments, saved when they change.

    Args:
        node: The node's fully qualified name.
        parameters: Those of the node: without ``run``, only ``shape_file`` is kept.
    """

    def __init__(self, node: str, parameters: FusionNodeParameters) -> None:
        kept = kept_file(node, parameters.run)
        self._subject = parameters.subject
        self._shape_file = Path(parameters.shape_file) if parameters.shape_file else kept
        self._person = Kept(kept, "person", str)
        self._alignments = Kept(kept, "alignments", partial(read_alignments, "the kept alignments"))
        self.person = self._person.load() or parameters.person
        """The rule by which the subject is chosen."""
        self.alignments: SensorsToSegments = {}
        """Sensor-to-segment rotations of all IMUs, also of silent ones."""

    def choose(self, person: str) -> None:
        """Keep another rule by which the subject is chosen."""
        self.person = person
        self._person.save(person)

    def load_shape(self, model: BodyModel) -> BodyShape | None:
        """The subject's body shape; None if there is none yet."""
        path = self._shape_file
        return None if path is None or not path.exists() else load_body_shape(path, model)

    def save_shape(self, model: BodyModel, shape: BodyShape) -> None:
        """Save the subject's body shape, unless there is one already.

        Raises:
            InputError: If the file cannot be written.
        """
        if self._shape_file is not None and not self._shape_file.exists():
            save_body_shape(self._shape_file, model, shape, self._subject)

    def load_alignments(self, known: SensorsToSegments) -> None:
        """Begin with the kept alignments, and those of a calibration where there are none."""
        self.alignments = {**known, **(self._alignments.load() or {})}

    def save_alignments(self, subject: Pipeline) -> None:
        """Save the subject's alignments; contradicted ones are left out."""
        contradicted = {use.segment for use in subject.imu_uses if use.contradictions}
        known = {s: each for s, each in self.alignments.items() if s not in contradicted}
        self.alignments = {**known, **subject.sensor_to_segment}
        self._alignments.save(alignments_document(self.alignments))
