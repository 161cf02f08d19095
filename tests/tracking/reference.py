"""The measures of sequences, by TrackEval or by motmetrics: `reference.py TOOL`, with the sequences as JSON on standard
input, and their measures as JSON on standard output.

A sequence is a list of frames, each with `objects` and `hypotheses`, lists of [identity, numbers]; and `cut_off_m`: null
if the numbers are boxes (left, top, width, height), the largest distance of a match if they are positions.
"""

import json
import sys

import numpy as np


def arrays(frame, size):
    """The identities and the numbers of a frame's objects, and those of its hypotheses."""
    for kind in ("objects", "hypotheses"):
        yield [instance[0] for instance in frame[kind]]
        yield np.array([instance[1] for instance in frame[kind]], dtype=float).reshape(-1, size)


def trackeval_measures(sequences):
    from trackeval.datasets._base_dataset import _BaseDataset
    from trackeval.metrics import CLEAR, HOTA, Identity

    class Similarity(_BaseDataset):
        """What TrackEval computes from two lists of boxes or of positions."""

        boxes = staticmethod(_BaseDataset._calculate_box_ious)
        positions = staticmethod(_BaseDataset._calculate_euclidean_similarity)

    def measures(frames, cut_off_m):
        numbers = {"objects": {}, "hypotheses": {}}
        data = {"gt_ids": [], "tracker_ids": [], "similarity_scores": [], "num_timesteps": len(frames)}
        counts = {"objects": 0, "hypotheses": 0}
        for frame in frames:
            objects, places, hypotheses, supposed = arrays(frame, 4 if cut_off_m is None else 3)
            for kind, ids, key in (("objects", objects, "gt_ids"), ("hypotheses", hypotheses, "tracker_ids")):
                known = numbers[kind]
                data[key].append(np.array([known.setdefault(id, len(known)) for id in ids], dtype=int))
                counts[kind] += len(ids)
            if cut_off_m is None:
                similar = Similarity.boxes(places, supposed, box_format="xywh")
            else:
                similar = Similarity.positions(places, supposed, zero_distance=2 * cut_off_m)
            data["similarity_scores"].append(similar)
        data["num_gt_ids"], data["num_tracker_ids"] = len(numbers["objects"]), len(numbers["hypotheses"])
        data["num_gt_dets"], data["num_tracker_dets"] = counts["objects"], counts["hypotheses"]
        quiet = {"PRINT_CONFIG": False}
        clear, identity = CLEAR(quiet).eval_sequence(data), Identity(quiet).eval_sequence(data)
        hota = HOTA().eval_sequence(data)
        return {
            "clear_mot": {
                "mota": clear["MOTA"],
                "motp": clear["MOTP"],
                "recall": clear["CLR_Re"],
                "precision": clear["CLR_Pr"],
                "matches": clear["CLR_TP"],
                "misses": clear["CLR_FN"],
                "false_positives": clear["CLR_FP"],
                "identity_switches": clear["IDSW"],
                "fragmentations": clear["Frag"],
                "mostly_tracked": clear["MT"],
                "partly_tracked": clear["PT"],
                "mostly_lost": clear["ML"],
            },
            "identity": {
                "idf1": identity["IDF1"],
                "idp": identity["IDP"],
                "idr": identity["IDR"],
                "true_positives": identity["IDTP"],
                "false_positives": identity["IDFP"],
                "false_negatives": identity["IDFN"],
            },
            "hota": {
                "hota": np.mean(hota["HOTA"]),
                "det_a": np.mean(hota["DetA"]),
                "ass_a": np.mean(hota["AssA"]),
                "loc_a": np.mean(hota["LocA"]),
            },
        }

    return [measures(one["frames"], one["cut_off_m"]) for one in sequences]


def motmetrics_measures(sequences):
    # motmetrics 1.4.0 calls a function that numpy 2 no longer has.
    if not hasattr(np, "asfarray"):
        np.asfarray = lambda numbers: np.asarray(numbers, dtype=float)
    import motmetrics

    names = {
        "clear_mot": {
            "mota": "mota",
            "motp": "motp",
            "recall": "recall",
            "precision": "precision",
            "matches": "num_detections",
            "misses": "num_misses",
            "false_positives": "num_false_positives",
            "identity_switches": "num_switches",
            "mostly_tracked": "mostly_tracked",
            "partly_tracked": "partially_tracked",
            "mostly_lost": "mostly_lost",
        },
        "identity": {
            "idf1": "idf1",
            "idp": "idp",
            "idr": "idr",
            "true_positives": "idtp",
            "false_positives": "idfp",
            "false_negatives": "idfn",
        },
    }

    def measures(frames, cut_off_m):
        accumulator = motmetrics.MOTAccumulator(auto_id=True)
        for frame in frames:
            objects, places, hypotheses, supposed = arrays(frame, 4 if cut_off_m is None else 3)
            if cut_off_m is None:
                apart = motmetrics.distances.iou_matrix(places, supposed, max_iou=0.5)
            else:
                apart = np.sqrt(motmetrics.distances.norm2squared_matrix(places, supposed, max_d2=cut_off_m**2))
            accumulator.update(objects, hypotheses, apart)
        every = [name for group in names.values() for name in group.values()]
        found = motmetrics.metrics.create().compute(accumulator, metrics=every, return_dataframe=False)
        measured = {group: {ours: found[theirs] for ours, theirs in of.items()} for group, of in names.items()}
        # Their precision is a distance: of boxes 1 - IoU, of positions metres.
        far = measured["clear_mot"]["motp"]
        measured["clear_mot"]["motp"] = 1 - far if cut_off_m is None else 1 - far / (2 * cut_off_m)
        return measured

    return [measures(one["frames"], one["cut_off_m"]) for one in sequences]


tools = {"trackeval": trackeval_measures, "motmetrics": motmetrics_measures}
json.dump(tools[sys.argv[1]](json.load(sys.stdin)), sys.stdout, default=float)
