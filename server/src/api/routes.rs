//! How a route is declared: a method, a path, the right that it asks for, its handler; then what it is about, what it
//! takes and what it gives. There is no way to add a route without saying who may ask for it, and a test asks for the rest.

use std::collections::HashMap;

use axum::Router;
use axum::handler::Handler;
use axum::http::Method;
use axum::routing::{MethodFilter, on};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;

use super::query;
use crate::error::Result;
use crate::rights::Right;
use crate::state::App;

/// What a route asks of its caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// A right.
    Right(Right),
    /// A right that may be shown in the first message of a websocket instead of its headers.
    Socket(Right),
    /// To write the session that the path names: `/sessions/{id}…`.
    OwnSession,
    /// To write the session of the log that the path names: `/logs/{id}…`.
    OwnLog,
    /// To have reported the fault that the path names, to be the one who sees to it, or to write everybody's: `/faults/{id}…`.
    OwnFault,
    /// The same, without being the one who sees to it: what is done cannot be undone.
    ReportedFault,
    /// To have made the mapping that the path names, or to write everybody's: `/mappings/{id}`.
    OwnMapping,
    /// A right, by somebody who has signed in: a token does not change accounts, sign-ins or tokens.
    SignedIn(Right),
}

impl From<Right> for Needs {
    fn from(right: Right) -> Needs {
        Needs::Right(right)
    }
}

/// Routes with what they ask for.
#[derive(Debug, Default)]
pub struct Routes {
    router: Router<App>,
    declared: Vec<Declared>,
}

/// One route, as it was declared.
#[derive(Clone, Debug)]
pub struct Declared {
    /// The method; a route of GET answers HEAD, too.
    pub method: Method,
    /// The path with its variable parts, such as `/api/v1/markers/{name}`.
    pub path: String,
    /// What it asks of its caller.
    pub needs: Needs,
    /// What it is about, in a line.
    pub about: &'static str,
    /// What comes after the question mark.
    pub query: Option<AskedQuery>,
    /// Its body.
    pub takes: Option<Content>,
    /// What is answered when all is well.
    pub gives: Option<Content>,
}

/// The shape of a type, for the description of the API.
pub type Shape = fn(&mut SchemaGenerator) -> Schema;

/// Reads a query and says what is wrong with it.
pub type ReadsQuery = fn(&str) -> Result<()>;

/// What comes after a question mark.
#[derive(Clone, Copy, Debug)]
pub struct AskedQuery {
    /// Its shape.
    pub shape: Shape,
    /// Reads one as the handler will.
    pub reads: ReadsQuery,
}

/// A body.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    /// JSON of this shape.
    Json(Shape),
    /// Bytes of this media type.
    Bytes(&'static str),
}

impl Routes {
    /// None yet.
    pub fn new() -> Routes {
        Routes::default()
    }

    /// A route that shows something.
    pub fn get<H, T>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Handler<T, App>,
        T: 'static,
    {
        self.on(Method::GET, path, needs, handler)
    }

    /// A route that adds something, or does something.
    pub fn post<H, T>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Handler<T, App>,
        T: 'static,
    {
        self.on(Method::POST, path, needs, handler)
    }

    /// A route that makes something so.
    pub fn put<H, T>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Handler<T, App>,
        T: 'static,
    {
        self.on(Method::PUT, path, needs, handler)
    }

    /// A route that changes something.
    pub fn patch<H, T>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Handler<T, App>,
        T: 'static,
    {
        self.on(Method::PATCH, path, needs, handler)
    }

    /// A route that removes something.
    pub fn delete<H, T>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Handler<T, App>,
        T: 'static,
    {
        self.on(Method::DELETE, path, needs, handler)
    }

    fn on<H, T>(mut self, method: Method, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Handler<T, App>,
        T: 'static,
    {
        let filter = MethodFilter::try_from(method.clone()).expect("the methods here have a filter");
        self.declared.push(Declared {
            method,
            path: path.to_owned(),
            needs: needs.into(),
            about: "",
            query: None,
            takes: None,
            gives: None,
        });
        Routes { router: self.router.route(path, on(filter, handler)), declared: self.declared }
    }

    /// What the route before is about, in a line.
    pub fn about(mut self, about: &'static str) -> Routes {
        self.last().about = about;
        self
    }

    /// The query that the route before takes.
    pub fn query<Q: JsonSchema + DeserializeOwned>(mut self) -> Routes {
        let reads: ReadsQuery = |query| query::read::<Q>(query).map(drop);
        self.last().query = Some(AskedQuery { shape: Q::json_schema, reads });
        self
    }

    /// The JSON that the route before takes.
    pub fn takes<B: JsonSchema>(mut self) -> Routes {
        self.last().takes = Some(Content::Json(|schemas| schemas.subschema_for::<B>()));
        self
    }

    /// The bytes that the route before takes.
    pub fn takes_bytes(mut self, kind: &'static str) -> Routes {
        self.last().takes = Some(Content::Bytes(kind));
        self
    }

    /// The JSON that the route before gives.
    pub fn gives<B: JsonSchema>(mut self) -> Routes {
        self.last().gives = Some(Content::Json(|schemas| schemas.subschema_for::<B>()));
        self
    }

    /// The bytes that the route before gives.
    pub fn gives_bytes(mut self, kind: &'static str) -> Routes {
        self.last().gives = Some(Content::Bytes(kind));
        self
    }

    fn last(&mut self) -> &mut Declared {
        self.declared.last_mut().expect("what is said is said of a route before")
    }

    /// These and others.
    pub fn merge(mut self, other: Routes) -> Routes {
        self.declared.extend(other.declared);
        Routes { router: self.router.merge(other.router), declared: self.declared }
    }

    /// These below a path.
    pub fn below(mut self, path: &str) -> Routes {
        for declared in &mut self.declared {
            declared.path.insert_str(0, path);
        }
        Routes { router: Router::new().nest(path, self.router), declared: self.declared }
    }

    /// These with something done to their router, such as a layer.
    pub fn with(self, change: impl FnOnce(Router<App>) -> Router<App>) -> Routes {
        Routes { router: change(self.router), declared: self.declared }
    }

    /// What answers.
    pub fn into_router(self) -> Router<App> {
        self.router
    }

    /// What was declared.
    pub fn declared(&self) -> &[Declared] {
        &self.declared
    }
}

/// What each route asks for, to be looked up.
#[derive(Debug)]
pub struct Table {
    by_path: HashMap<String, Vec<(Method, Needs)>>,
}

impl Table {
    /// Of these routes.
    pub fn of(declared: &[Declared]) -> Table {
        let mut by_path: HashMap<String, Vec<(Method, Needs)>> = HashMap::new();
        for Declared { method, path, needs, .. } in declared {
            by_path.entry(path.clone()).or_default().push((method.clone(), *needs));
        }
        Table { by_path }
    }

    /// What a route asks for; `None` where there is no such route.
    pub fn needs(&self, method: &Method, path: &str) -> Option<Needs> {
        self.by_path.get(path)?.iter().find(|(known, _)| known == method).map(|(_, needs)| *needs)
    }

    /// Whether a path is declared with any method.
    pub fn has(&self, path: &str) -> bool {
        self.by_path.contains_key(path)
    }
}
