//! The derive macro `JsonSchema` of builds that do not generate the JSON Schema. It replaces the macro of the crate
//! schemars, so that the attributes of types are the same in all builds.

use proc_macro::TokenStream;

/// Generates no code.
#[proc_macro_derive(JsonSchema, attributes(schemars))]
pub fn derive_nothing(_: TokenStream) -> TokenStream {
    TokenStream::new()
}
