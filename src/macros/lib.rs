//! Attributes of the types that are exchanged as JSON.

use proc_macro::TokenStream;
use quote::ToTokens;
use syn::{Attribute, Field, Item, Type, parse_macro_input, parse_quote};

/// Omits the `Option` members of a struct, or of the variants of an enum, from the JSON while they are `None`, and declares them in the
/// contract as never `null`.
///
/// It adds `#[serde(skip_serializing_if = "Option::is_none")]` and `#[schema(nullable = false)]` to each of them, so it stands above the
/// derives. A member with a `#[schema(nullable …)]` of its own keeps that; a member with `#[or_null]` is `null` while it is `None`.
#[proc_macro_attribute]
pub fn none_is_absent(_: TokenStream, item: TokenStream) -> TokenStream {
    let mut item = parse_macro_input!(item as Item);
    match &mut item {
        Item::Struct(item) => item.fields.iter_mut().for_each(omit_none),
        Item::Enum(item) => {
            let fields = item.variants.iter_mut().flat_map(|it| &mut it.fields);
            fields.for_each(omit_none);
        }
        _ => {}
    }
    item.into_token_stream().into()
}

fn omit_none(field: &mut Field) {
    let Type::Path(path) = &field.ty else { return };
    if path
        .path
        .segments
        .last()
        .is_none_or(|it| it.ident != "Option")
    {
        return;
    }
    let or_null = |it: &Attribute| it.path().is_ident("or_null");
    if field.attrs.iter().any(or_null) {
        return field.attrs.retain(|it| !or_null(it));
    }
    let omitted = parse_quote!(#[serde(skip_serializing_if = "Option::is_none")]);
    field.attrs.push(omitted);
    let nullable = |it: &Attribute| {
        it.path().is_ident("schema") && it.to_token_stream().to_string().contains("nullable")
    };
    if !field.attrs.iter().any(nullable) {
        field.attrs.push(parse_quote!(#[schema(nullable = false)]));
    }
}
