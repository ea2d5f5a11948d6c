//! Attributes of the types that are exchanged as JSON, and of the calls of the job table.

use proc_macro::TokenStream;
use quote::{ToTokens, quote};
use syn::{
    Attribute, Field, ImplItem, Item, ItemEnum, ItemImpl, LitStr, Type, Variant, parse_macro_input,
    parse_quote,
};

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

/// Runs the body of each async method of an `impl` by `engine::again`, which repeats it if its transaction gave way to another one.
///
/// It stands above `#[async_trait]`. A method with `#[once]` stays as it is.
#[proc_macro_attribute]
pub fn repeat_conflicts(_: TokenStream, item: TokenStream) -> TokenStream {
    let mut item = parse_macro_input!(item as ItemImpl);
    for member in &mut item.items {
        let ImplItem::Fn(method) = member else {
            continue;
        };
        let once = |it: &Attribute| it.path().is_ident("once");
        if method.attrs.iter().any(once) {
            method.attrs.retain(|it| !once(it));
        } else if method.sig.asyncness.is_some() {
            let body = &method.block;
            method.block = parse_quote!({ engine::again(|| async move #body).await });
        }
    }
    item.into_token_stream().into()
}

/// Gives an enum of unit variants `WORDS`: the words of a request and what they mean, in the order of the variants. A word is the name of its
/// variant in snake case, as by `#[serde(rename_all = "snake_case")]`, or that of `#[serde(rename = …)]`.
#[proc_macro_derive(Words)]
pub fn words(item: TokenStream) -> TokenStream {
    let item = parse_macro_input!(item as ItemEnum);
    let (name, variants) = (&item.ident, item.variants.iter().map(|it| &it.ident));
    let words = item.variants.iter().map(word);
    quote! {
        impl #name {
            /// The words of a request and what they mean.
            pub(crate) const WORDS: &'static [(&'static str, #name)] = &[#((#words, #name::#variants)),*];
        }
    }
    .into()
}

fn word(variant: &Variant) -> String {
    let mut word = String::new();
    for letter in variant.ident.to_string().chars() {
        if letter.is_uppercase() && !word.is_empty() {
            word.push('_');
        }
        word.extend(letter.to_lowercase());
    }
    for attribute in variant
        .attrs
        .iter()
        .filter(|it| it.path().is_ident("serde"))
    {
        // What is not a new name is for serde to judge.
        let _ = attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("rename") {
                word = meta.value()?.parse::<LitStr>()?.value();
            }
            Ok(())
        });
    }
    word
}
