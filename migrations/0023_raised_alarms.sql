-- The server itself watches for alarms: what stands, so that a restart raises nothing twice, and what stood.
create table alarms (
    key               text    not null primary key, -- as in alarm_acknowledgements: the same thing that comes again has another key
    kind              text    not null check (kind in ('lost', 'standing', 'fault')),
    session_id        text,                         -- the walk it is about; null where it is about none
    carrier_id        text,                         -- who walks, or reported the fault; null where nobody is known
    fault_id          text,                         -- the fault it is about; null where it is about none
    since             integer not null,             -- UTC µs since when it has been so: the last word, the last step, the report
    raised_at         integer not null,             -- UTC µs
    ended_at          integer                       -- UTC µs when it was so no longer; null while it is
) strict, without rowid;
create index alarms_standing on alarms (key) where ended_at is null;
