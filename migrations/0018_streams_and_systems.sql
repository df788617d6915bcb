-- Streams in place of feet, carriers in place of inspectors, systems (`docs/wire.md`). Nothing that is large is written again: columns are
-- renamed, and the checks that knew two feet only are taken out of the schema's own text, as SQLite's page on ALTER TABLE
-- describes it for constraints; an upgrade takes as long with a thousand walks as with one.

-- What is positioned: a person, an instrument. A person is what the page calls an inspector.
alter table inspectors rename to carriers;
alter table carriers add column kind text not null default 'person'; -- person, instrument, …: as the system declares it
alter table sessions rename column inspector_id to carrier_id;

-- Which system computes the session.
alter table sessions add column system text not null default 'pedestrian';

-- The streams of a session: what its readings come in.
create table streams (
    session_id      text    not null references sessions (id) on delete cascade,
    number          integer not null,   -- within the session, as binary frames carry it
    name            text    not null,   -- within the session, as messages and the tables below spell it
    role            text    not null,   -- what it is to the system: one of the roles that the system declares
    kind            text    not null check (kind in ('imu', 'values')), -- samples of an inertial sensor, or rows of numbers
    lever_arm_x_m   real,               -- from the body's origin to where it measures, in b; null where the system needs none
    lever_arm_y_m   real,
    lever_arm_z_m   real,
    primary key (session_id, number),
    unique (session_id, name)
) strict, without rowid;
insert into streams (session_id, number, name, role, kind)
    select id, 0, 'left', 'left_foot', 'imu' from sessions where feet in ('left', 'left,right')
    union all
    select id, 1, 'right', 'right_foot', 'imu' from sessions where feet in ('right', 'left,right');
alter table sessions drop column feet;

-- The name of the stream, where there was a foot.
alter table logs rename column foot to stream;
alter table raw_chunks rename column foot to stream;
alter table stream_chunks rename column foot to stream;
alter table anomalies rename column foot to stream;

-- These tables' checks: " check (stream in ('left', 'right'))" and no more goes out of their text.
pragma writable_schema = on;
update sqlite_schema set sql = replace(sql, ' check (stream in (''left'', ''right''))', '')
    where type = 'table' and name in ('logs', 'raw_chunks', 'stream_chunks', 'anomalies');
pragma writable_schema = reset;

-- The parts of a point, by number: the feet of a walk were the first two. Roll and pitch, where a system has them.
alter table track_points rename column left_e_m to part_0_e_m;
alter table track_points rename column left_n_m to part_0_n_m;
alter table track_points rename column left_u_m to part_0_u_m;
alter table track_points rename column right_e_m to part_1_e_m;
alter table track_points rename column right_n_m to part_1_n_m;
alter table track_points rename column right_u_m to part_1_u_m;
alter table track_points rename column left_stance to part_0_stance;
alter table track_points rename column right_stance to part_1_stance;
alter table track_points add column roll_rad real;
alter table track_points add column pitch_rad real;
alter table track_points add column sigma_roll_rad real;
alter table track_points add column sigma_pitch_rad real;

-- States of live sessions are for the program that saved them: those of the release before are of no use to this one.
drop trigger live_states_go_with_a_visit;
drop table live_states;
create table live_states (
    id              integer not null primary key,
    session_id      text    not null references sessions (id) on delete cascade,
    t_ns            integer not null,   -- since when the state knows its past, ns
    fits            text    not null,   -- hash of the program that saved it and of how the session was configured
    samples         integer not null,   -- taken before, of all streams
    next_sequences  text    not null,   -- JSON by stream: the batches that were not taken yet begin here
    body            blob    not null    -- for that program alone
) strict;
create unique index live_states_of_session on live_states (session_id, t_ns);

-- A visit that is taken back is in every state that was saved since it was told: the session is then made from its samples.
create trigger live_states_go_with_a_visit after delete on stream_visits begin
    delete from live_states where session_id = old.session_id;
end;
