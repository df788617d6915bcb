//! How this server speaks HTTP, whatever it is about. A route is declared ([`Routes`]) with a handler whose types say what
//! it takes ([`extract`]) and what it gives ([`answer`]); from these ([`operation`]) and from a list of the problems that no
//! type tells ([`operation_list`]) the description is made ([`openapi`]). A JSON body or a query that does not fit is explained
//! by the same schema that describes it.

pub mod answer;
pub mod extract;
pub mod media;
pub mod openapi;
pub mod operation;
pub mod operation_list;
pub mod pages;
pub mod request;
pub mod schemas;

mod example;
mod json_body;
mod query;
mod routes;
mod schema_mismatch;

pub use answer::{
    Accepted, Answer, AnswerBody, AnswerHeader, Attachment, Created, File, Kept, Location, MaybeNew,
    NoContent, Refusal, Upgraded, Version, With, WrittenJson,
};
pub use extract::{BytesBody, CsvBody, IfMatch, Json, Path, Query, StreamedBody, UploadOffset, UserAgent};
pub(crate) use json_body::read as read_json;
pub use operation::{Describer, Operation};
pub use pages::{Listed, Page};
pub use request::{ReadsQuery, RequestPart};
pub use routes::{Declared, Needs, Routes, Table};
