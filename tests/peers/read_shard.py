"""Reads every shard of a dataset by reflection alone (mcap, mcap-protobuf-support): prints facts to compare."""

import json
import pathlib
import sys

import numpy
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

facts = []
for path in sorted(pathlib.Path(sys.argv[1], "shards").glob("*.mcap")):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, record in reader.iter_decoded_messages():
            assert message.log_time == message.publish_time
            row = {"index": message.log_time, "topic": channel.topic, "subject": record.sample.subject.hex()}
            row["item"] = record.sample.item
            if channel.topic == "/completion/pair":
                n = record.grid.resolution

                def plane(data):
                    bits = numpy.unpackbits(numpy.frombuffer(data, numpy.uint8), bitorder="little")
                    return bits[: n**3].reshape(n, n, n)

                partial, complete = plane(record.partial), plane(record.complete)
                assert partial.sum() == record.partial_cells
                assert complete.sum() == record.complete_cells
                assert (partial & complete).sum() == record.both_cells
                row["first"] = [int(place) for place in numpy.argwhere(complete)[0]]
                row["last"] = [int(place) for place in numpy.argwhere(partial)[-1]]
                row["pose"] = list(record.camera_from_object)
            facts.append(row)
        attachments = [attachment.name for attachment in reader.iter_attachments()]
        assert attachments == ["ledger", "facts", "digests"], attachments
print(json.dumps(facts))
