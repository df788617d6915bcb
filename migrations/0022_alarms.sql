-- Alarms of the live page stay until somebody has acknowledged them, for everybody who looks.
create table alarm_acknowledgements (
    key               text    not null primary key, -- what the alarm is about: its kind, its subject, and when it began where it can come again
    acknowledged_at   integer not null,             -- UTC µs
    acknowledged_by   text    not null              -- who, as the log of changes has it
) strict, without rowid;
