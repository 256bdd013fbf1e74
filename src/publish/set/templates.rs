//! Templates of the page of a set.

use crate::templates::PageTemplates;

/// Name of the template of the page.
pub(crate) const PAGE_TEMPLATE: &str = "set.html";

/// The page, with what all pages share.
pub(crate) static TEMPLATES: PageTemplates =
    PageTemplates::new(&[(PAGE_TEMPLATE, include_str!("page.html")), ("set.css", include_str!("set.css"))]);
