"""Compares frames that cantools decodes with footfall.dbc with the values that were encoded.

usage: dbc.py DBC FRAMES, with FRAMES as written by tests/python.rs
"""

import csv
import struct
import sys

import cantools


def main(dbc, frames):
    # Strict: signals that overlap are an error.
    database = cantools.database.load_file(dbc, strict=True)
    count = 0
    decoded = {}
    seen = set()
    with open(frames, newline="", encoding="utf-8") as table:
        for row in csv.DictReader(table, delimiter="\t"):
            key = (int(row["id"]), row["data"])
            message = database.get_message_by_frame_id(key[0])
            if key not in decoded:
                assert message.name == row["message"], row
                assert message.senders == [message.name.split("_")[0]], message.name
                seen.add(message.name)
                data = bytes.fromhex(key[1])
                decoded[key] = message.decode(data, decode_choices=False), message.decode(data)
                # Encoding gives the same bytes back.
                bits = message.encode(decoded[key][0], strict=False)
                used = [s.length for s in message.signals]
                if sum(used) == 64:
                    assert bits == data, (message.name, bits.hex(), key[1])
            values, names = decoded[key]
            value = values[row["signal"]]
            assert abs(value - float(row["value"])) <= float(row["tolerance"]), (row, value)
            if row["name"]:
                assert str(names[row["signal"]]) == row["name"], (row, names)
            signal = message.get_signal_by_name(row["signal"])
            if str(names[row["signal"]]) != "no_value":
                low, high = signal.minimum, signal.maximum
                assert low - 1e-6 <= value <= high + 1e-6, (row, value)
            count += 1
    # A quantity without a value has the code for "no value".
    signed = 0
    for message in database.messages:
        assert message.name in seen or message.name.endswith("_Load"), message.name
        for signal in message.signals:
            assert signal.comment, signal.name
            if not signal.is_signed or signal.length != 16:
                continue
            signed += 1
            frame = bytearray(8)
            frame[signal.start // 8 + 1] = 0x80
            assert message.decode(bytes(frame))[signal.name] == "no_value", signal.name
            assert "no value" in signal.comment, signal.name
    assert signed == 6 * 14, signed
    assert len(database.messages) == len(seen) + 6
    contact = database.get_message_by_name("FL_Contact")
    assert contact.cycle_time == 1
    assert database.get_message_by_name("RR_Heartbeat").cycle_time == 500
    load = database.get_message_by_name("FL_Load")
    assert load.frame_id == 0x211 and load.decode(struct.pack("<f", -12.5)) == {"Load": -12.5}
    print(f"{count} values agree")


if __name__ == "__main__":
    main(*sys.argv[1:])
