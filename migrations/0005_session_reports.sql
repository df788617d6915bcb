-- How a walk went by what the filter itself saw, of the main run: replaced whenever that is.

create table session_reports (
    session_id  text    not null primary key references sessions (id) on delete cascade,
    report      text    not null    -- JSON: aids with their innovations and bounds, what was turned down and why, closure, sigmas, stance
) strict;
