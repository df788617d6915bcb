//! Lists that grow for years, a page at a time: the rest of one is found by the link of RFC 8288 in the answer's header.

use axum::http::HeaderValue;
use uuid::Uuid;

use super::answer::{AnswerHeader, With};
use super::extract::Json;

/// Rows in one answer at most, and where fewer are not asked for: so many are read in some ten milliseconds.
const MOST: u32 = 1_000;

/// Which part of a list is asked for. The list is in the order of an instant and, where that is the same, of the id.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    /// The last row of the page before, by its instant (µs, Unix time) and its id; `None`: from the first. Both, so that
    /// the list goes on when that row has been removed meanwhile.
    pub before: Option<(i64, Uuid)>,
    limit: u32,
}

/// Where the rest of a list is.
#[derive(Clone, Debug)]
pub struct NextPage(String);

impl AnswerHeader for NextPage {
    const NAME: &'static str = "Link";
    const ABOUT: &'static str = "<path>; rel=\"next\": where the list goes on; left out with the last page";

    fn value(self) -> HeaderValue {
        HeaderValue::try_from(format!("<{}>; rel=\"next\"", self.0)).expect("paths of ours are plain text")
    }
}

/// A page of a list.
pub type Listed<T> = With<Option<NextPage>, Json<Vec<T>>>;

impl Page {
    /// The page with what was asked for.
    pub fn new(before: (Option<i64>, Option<Uuid>), limit: Option<u32>) -> Self {
        Self { before: before.0.zip(before.1), limit: limit.unwrap_or(MOST).clamp(1, MOST) }
    }

    /// How many rows to read: one more than are shown tells whether there is another page.
    pub fn rows_to_read(self) -> u32 {
        self.limit + 1
    }

    /// The answer with the rows that were read. `path` is that of the list, `filter` the rest of its query.
    pub fn answer<T>(
        self,
        mut rows: Vec<T>,
        (path, filter): (&str, &[(&str, Option<String>)]),
        place: impl Fn(&T) -> (i64, Uuid),
    ) -> Listed<T> {
        let shown = self.limit as usize;
        let goes_on = rows.len() > shown;
        rows.truncate(shown);
        let next = rows.last().filter(|_| goes_on).map(|last| {
            let (before_us, before_id) = place(last);
            let mut next = format!("{path}?limit={}&before_us={before_us}&before_id={before_id}", self.limit);
            for (name, value) in filter {
                if let Some(value) = value {
                    next.push_str(&format!("&{name}={value}"));
                }
            }
            NextPage(next)
        });
        With(next, Json(rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(rows: u128, limit: u32) -> (Vec<u128>, Option<String>) {
        let page = Page::new((None, None), Some(limit));
        let read = (1..=rows).take(page.rows_to_read() as usize).collect();
        let With(next, Json(rows)) =
            page.answer(read, ("/api/v1/sessions", &[("state", None)]), |n| (-7, Uuid::from_u128(*n)));
        (rows, next.map(|next| next.value().to_str().unwrap().to_owned()))
    }

    #[test]
    fn a_page_says_where_the_list_goes_on_and_the_last_one_does_not() {
        let (rows, next) = listed(3, 2);
        assert_eq!(rows, [1, 2]);
        let last = Uuid::from_u128(2);
        assert_eq!(
            next.unwrap(),
            format!("</api/v1/sessions?limit=2&before_us=-7&before_id={last}>; rel=\"next\"")
        );
        assert_eq!(listed(2, 2), (vec![1, 2], None));
        assert_eq!(listed(0, 2), (vec![], None));
        assert_eq!(listed(5_000, u32::MAX).0.len(), 1_000);
    }
}
